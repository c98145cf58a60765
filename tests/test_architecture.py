"""docs/architecture.md says what contracts, imports and tree say; papers name what there is."""

import re
import tomllib
from collections import defaultdict
from itertools import pairwise
from pathlib import Path

import grimp
import pytest

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs/architecture.md").read_text("utf-8")
SECTIONS = dict(re.findall(r"^## (.+)\n((?:(?!^## ).*\n)*)", PAGE, re.MULTILINE))
PAPERS = [ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
WAYS = [title for title in SECTIONS if title.startswith("The way of")]
CONTRACTS = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"][
    "contracts"
]
(LAYERS,) = (one["layers"] for one in CONTRACTS if one.get("containers") == ["rig"])


def rooms_of(layer: str) -> list[str]:
    return [name.strip() for name in re.split(r"[|:]", layer)]


ROOMS = {room for layer in LAYERS for room in rooms_of(layer)}


def arrows(title: str) -> list[tuple[str, str]]:
    """Steps from place to place of a way's line."""
    (line,) = re.findall(r"^```text\n(.+)\n```", SECTIONS[title], re.MULTILINE)
    return list(pairwise(line.split(" → ")))


def steps(title: str) -> list[tuple[str, str]]:
    """Steps from room to room of a way's table."""
    places = [name.removeprefix("rig/").partition("/")[0] for name in files(title)]
    rooms = [place.removesuffix(".py") for place in places]
    return [step for step in pairwise(rooms) if step[0] != step[1]]


def files(title: str) -> list[str]:
    """Files of a way's table, in order; each with its folder."""
    rows = re.findall(r"^\| `([\w/]+)` \| (`[^|]+`) \|", SECTIONS[title], re.MULTILINE)
    return [f"{where}/{name}" for where, names in rows for name in re.findall(r"`(.+?)`", names)]


@pytest.fixture(scope="module")
def imports() -> set[tuple[str, str]]:
    """Which room really imports which."""
    graph = grimp.build_graph("rig", cache_dir=None)
    found = set()
    for module in graph.modules - {"rig"}:
        for other in graph.find_modules_directly_imported_by(module) - {"rig"}:
            found.add((module.split(".")[1], other.split(".")[1]))
    return found


def test_the_rooms_stand_as_the_contract_has_them():
    layers = re.findall(r"^\| `(.+?)` \|", SECTIONS["Rooms"], re.MULTILINE)
    assert [layer.replace("\\", "") for layer in layers] == LAYERS


def test_every_room_is_on_the_page():
    found = {
        path.stem
        for path in (ROOT / "rig").iterdir()
        if path.suffix == ".py" or (path.is_dir() and any(path.rglob("*.py")))
    } - {"__init__"}
    assert found == ROOMS


@pytest.mark.parametrize("title", WAYS)
def test_every_step_is_an_import(title, imports):
    """That the contracts allow each import, lint-imports sees."""
    for one, other in (*arrows(title), *steps(title)):
        for place in {one, other} - ROOMS:
            assert (ROOT / place).is_dir(), place
        if {one, other} <= ROOMS:
            # What goes from room to room is handed over by the one that knows the other.
            assert {(one, other), (other, one)} & imports, (one, other)


@pytest.mark.parametrize("title", WAYS)
def test_files_of_a_way_are_there_and_counted(title):
    named = files(title)
    assert len(named) == len(set(named))
    for name in named:
        assert (ROOT / name).is_file(), name
    (stated,) = re.findall(r"\*\*(\d+) files", SECTIONS[title])
    assert int(stated) == len(named)


@pytest.mark.parametrize("paper", PAPERS, ids=lambda path: path.name)
def test_files_that_a_paper_names_are_there(paper):
    text = paper.read_text("utf-8")
    for name in re.findall(r"`((?:rig|sim|tests|firmware|protocols)/[\w./-]+\.\w+)`", text):
        assert (ROOT / name).is_file(), name
    for name in re.findall(r"`(\w+\.py)`", text):
        assert any(path for top in ("rig", "tests") for path in (ROOT / top).rglob(name)), name


def test_a_public_class_name_means_one_thing():
    places = defaultdict(list)
    for path in sorted((ROOT / "rig").rglob("*.py")):
        for name in re.findall(r"(?m)^ *class ([A-Za-z]\w*)", path.read_text("utf-8")):
            places[name].append(str(path.relative_to(ROOT)))
    assert {name: where for name, where in places.items() if len(where) > 1} == {}


def test_a_commit_is_checked_as_the_tests_begin():
    entries = re.findall(
        r"entry: \.venv/(.+)", (ROOT / ".pre-commit-config.yaml").read_text("utf-8")
    )
    run = (ROOT / "run").read_text("utf-8")
    checks = re.findall(r'^    "\$bin/((?:ruff|mypy|lint)[-\w" .]*)', run, re.MULTILINE)
    assert [f"bin/{check.replace(chr(34), '', 1).strip()}" for check in checks] == entries
