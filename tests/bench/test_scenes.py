"""What a scene does not have costs nothing: modules and counts, each in a process of its own.

How long anything takes is never tested.
"""

from __future__ import annotations

import csv
import json
from itertools import pairwise

import pytest

from rig.bench import scenes as bench
from rig.bench.scene_probe import bytecodes, evaluations
from rig.bench.scenes import ladder
from rig.cli import main
from rig.model.fall import hits
from tests.model.chains import even_chain

NAMES = [scene.name for scene in ladder()]
ALL = set(NAMES)
STRUCK = ALL - {"free fall"}
HAVE = {
    "rig.model.fall": ALL,
    "rig.model.impact": STRUCK,
    "rig.model.predict": STRUCK,
    "rig.model.surface": STRUCK,
    "rig.protocol.gates": {"gates"},
    "rig.model.drag": {"drag, no gates"},
}
NEVER = {
    "rig.model.motion", "rig.model.batch", "rig.model.rods", "rig.protocol.masses",
    "rig.protocol.plan", "rig.protocol.site", "rig.report.columns", "difflib", "random",
}  # fmt: skip


@pytest.fixture(scope="module")
def accounts(tmp_path_factory):
    folder = tmp_path_factory.mktemp("scenes")
    found = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bench, "_PROBES", 2)  # enough to see that they count the same
        for scene in ladder():
            path = folder / "scene.yaml"
            path.write_text(scene.text, "utf-8")
            found[scene.name] = bench.account(path)
    return found


@pytest.mark.parametrize("module", HAVE)
def test_only_scenes_that_need_a_module_load_it(accounts, module):
    assert {name for name in NAMES if module in accounts[name].modules} == HAVE[module]


@pytest.mark.parametrize("name", NAMES)
def test_what_no_step_of_the_ladder_needs_is_not_loaded(accounts, name):
    assert NEVER.isdisjoint(accounts[name].modules)
    assert accounts[name].packages == ("yaml",), "predicting needs neither numpy nor scipy"


@pytest.mark.parametrize(
    ("name", "impacts", "inclined", "falls"),
    [
        ("free fall", 0, 0, 0),
        ("α given, level", 1, 0, 1),
        ("level surface", 1, 0, 1),
        ("inclined", 1, 1, 1),
        # Once for the value, and twice for each of β and μ; a fall also twice for the drop.
        ("± on β, μ, drop", 5, 5, 7),
        ("second chain", 5, 5, 7),
        ("six inclines", 30, 30, 42),
        ("gates", 30, 30, 42),
        ("drag, no gates", 30, 30, 42),
    ],
)
def test_a_prediction_evaluates_what_its_scene_has(accounts, name, impacts, inclined, falls):
    found = accounts[name].evaluations
    assert found["impact coefficients"] == impacts
    assert found["g(θ)"] == inclined
    assert found["falls"] == falls
    assert found["trajectories"] == 0


def test_roots_are_taken_one_a_leg(accounts):
    roots = {name: account.evaluations["square roots"] for name, account in accounts.items()}
    assert roots["free fall"] == 1
    # 25 legs a fall, and the free chain's speed once an incline.
    assert roots["level surface"] == 25 + 1
    assert roots["± on β, μ, drop"] == 7 * 25 + 1
    assert roots["gates"] == 6 * (7 * 25 + 1)


def test_a_richer_scene_takes_more(accounts):
    for kind, names in {
        "predict": NAMES,
        # A given α is one more key to read than a level surface's β, and no less to say.
        "read": [name for name in NAMES if name not in {"α given, level", "drag, no gates"}],
    }.items():
        work = [accounts[name].operations[kind] for name in names]
        assert all(less <= more for less, more in pairwise(work)), (kind, work)
    first = accounts[NAMES[0]].operations["predict"]
    assert all(accounts[name].operations["predict"] > 10 * first for name in STRUCK)


def test_the_counters_count():
    chain = even_chain(5)
    found = evaluations(lambda: hits(chain, [0.1] * 5, 0.1, 9.81))
    assert (found["trajectories"], found["square roots"], found["falls"]) == (1, 5, 0)

    def loop(turns):
        for _ in range(turns):
            pass

    none, ten, twenty = (bytecodes(lambda n=n: loop(n)) for n in (0, 10, 20))
    assert 0 < none < ten < twenty
    assert twenty - ten == ten - none


def test_the_command_prints_a_table_and_keeps_it(monkeypatch, capsys, tmp_path):
    steps = ladder()[:2]
    monkeypatch.setattr(bench, "ladder", lambda: steps)
    ready, kept = tmp_path / "ready", tmp_path / "kept"
    ready.mkdir()
    (ready / "mine.yaml").write_text(ladder()[3].text, "utf-8")
    assert (
        main(["bench", "scenes", "--rounds", "1", "--protocols", str(ready), "-o", str(kept)]) == 0
    )
    heading, *rows = capsys.readouterr().out.splitlines()
    assert heading.split()[:2] == ["scene", "modules"]
    names = ["free fall", "α given, level", "mine"]
    assert all(row.startswith(name) for row, name in zip(rows, names, strict=False))
    whole = json.loads((kept / "scenes.json").read_text("utf-8"))
    assert [scene["scene"] for scene in whole["scenes"]] == names
    assert whole["scenes"][0]["added"] == []
    assert "rig.model.impact" in whole["scenes"][1]["added"]
    with (kept / "scenes.csv").open(encoding="utf-8", newline="") as file:
        lines = list(csv.DictReader(file))
    assert [line["scene"] for line in lines] == names
    assert [line["g(θ)"] for line in lines] == ["0", "0", "1"]
    assert (kept / "scenes.svg").read_text("utf-8").lstrip().startswith("<?xml")
