"""Commands of all pages work as printed, in an installed wheel; what README shows is so."""

import os
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

from rig.cli import _parser
from tests.programs import run_program
from tests.tables import read_table

ROOT = Path(__file__).parents[1]
PAGES = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "firmware/README.md")),
    *sorted((ROOT / "docs").glob("*.md")),
]
CHOICE = (ROOT / "rig/commands/choose.txt").read_text("utf-8")
NOT_RUN = read_table(__file__, "not_run")
"""Parts of commands that no test runs as printed, and why."""
BEFORE = read_table(__file__, "done_before")
CHAINS, DROPS, *_ = BEFORE["timers.md"]
"""What the reader of a page has done before."""
OTHER = f"{DROPS.replace('my.', 'other.')} --seed 2"

ONE_PROCESS = """
import shlex, subprocess, sys
from rig.cli import main

for line in sys.argv[1:]:
    words = shlex.split(line, comments=True)
    ours = words[0] == "rig" and not {"|", ">", ">>", "<", "&&", ";"} & {*words}
    code = main(words[1:]) if ours else subprocess.run(["bash", "-c", line]).returncode
    if code:
        sys.exit(f"{line} ended with {code}")
"""
"""Commands one after the other: what each has to load takes longer than most of them."""


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """An environment with the wheel in it, outside the clone; other packages are the tests' own."""
    folder = tmp_path_factory.mktemp("installed")
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check"]
    wheels, environment = folder / "wheels", folder / "environment"
    subprocess.run([*pip, "wheel", "-q", "--no-deps", "-w", wheels, ROOT], check=True)
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", environment], check=True)
    (wheel,) = wheels.iterdir()
    python = environment / "bin/python"
    subprocess.run([*pip, "--python", python, "install", "-q", "--no-deps", wheel], check=True)
    paths = sysconfig.get_paths(vars={"base": str(environment), "platbase": str(environment)})
    packages = Path(paths["purelib"])
    (packages / "others.pth").write_text(f"{sysconfig.get_paths()['purelib']}\n")
    assert not (packages / "sim").exists(), "this name is left to others, who may have it"
    (packages / "sim.py").write_text("raise SystemExit('this is another package')\n")
    return environment


def carry_out(folder, installed, first, *more):
    """Run commands in a folder as somebody who has activated the environment of the wheel.

    The first is run by a shell, as it stands; those that follow it in one process.
    """
    path = f"{installed / 'bin'}:{os.environ['PATH']}"
    where = {"cwd": folder, "env": os.environ | {"PATH": path, "MPLBACKEND": "agg"}}
    said = ""
    for words in (["/bin/bash", "-c", first], ["python", "-c", ONE_PROCESS, *more])[
        : 1 + any(more)
    ]:
        said += run_program(*words, timeout=None, stdin=subprocess.DEVNULL, **where).stdout
    return said


@pytest.fixture(scope="module")
def chains(tmp_path_factory, installed):
    """A folder in which the reader has drafted two chains, as most pages begin."""
    folder = tmp_path_factory.mktemp("chains")
    carry_out(folder, installed, CHAINS)
    return folder


@pytest.fixture
def reader(page, tmp_path, chains, installed):
    """Return a folder in which the reader of a page has done what comes before it."""
    before = BEFORE.get(page.name, ())
    if before[:1] == [CHAINS]:
        shutil.copytree(chains, tmp_path, dirs_exist_ok=True)
        before = before[1:]
    if before:
        carry_out(tmp_path, installed, *before)
    (tmp_path / ".venv").symlink_to(installed)
    return tmp_path


def commands(page: Path, language: str = "sh") -> list[str]:
    """Lines of a page's code blocks; those of ``shell`` need a board, those of ``sh`` do not."""
    block = rf"^```{language}\n(.*?)^```"
    blocks = re.findall(block, page.read_text("utf-8"), re.MULTILINE | re.DOTALL)
    return [line for block in blocks for line in block.splitlines()]


def runnable(page: Path) -> list[str]:
    lines = [line for language in ("sh", "shell") for line in commands(page, language)]
    return [line for line in lines if not any(part in line for part in NOT_RUN)]


@pytest.mark.parametrize("page", list(filter(runnable, PAGES)), ids=lambda page: page.name)
def test_every_command_works_in_an_installed_wheel(page, reader, installed):
    follows = page.name == "tutorial.md"  # what docs/python.md begins with
    carry_out(reader, installed, *runnable(page), *[OTHER] * follows)
    if follows:
        (reader / "page.py").write_text("\n".join(commands(ROOT / "docs/python.md", "python")))
        said = carry_out(reader, installed, "python page.py")
        assert r"\begin{tabular}" in said
        assert r"\pm" in said
        assert (reader / "separation.svg").is_file()


def test_each_reason_not_to_run_a_command_is_needed():
    every = [line for page in PAGES for kind in ("sh", "shell") for line in commands(page, kind)]
    assert all(any(part in line for line in every) for part in NOT_RUN)


def test_every_command_of_the_choice_works(tmp_path, installed):
    """That each scene can be drafted is for tests/scenes."""
    choice = re.findall(r"`(rig (?:new|check|predict) [^`]*)`", CHOICE)
    assert len(choice) == 7
    for command in choice:
        _parser().parse(shlex.split(command)[1:])
    carry_out(tmp_path, installed, *[each for each in choice if not each.startswith("rig new")])


def test_readme_begins_with_the_choice_that_new_shows():
    assert CHOICE in (ROOT / "README.md").read_text("utf-8")


def test_the_teachers_page_has_few_new_words():
    new = re.findall(r"(?<!\*)\*(\w[^*\n]*)\*(?!\*)", (ROOT / "docs/build.md").read_text("utf-8"))
    assert 10 <= len(set(new)) == len(new) <= 15, new


def test_the_demo_finds_the_truth():
    said = " ".join(run_program("./run", "demo", timeout=None, cwd=ROOT).stdout.split())
    held, of = re.search(r"([0-9]+) of ([0-9]+) results agree", said).groups()
    assert int(of) == 18
    assert int(held) >= 14, "at 95 % that is fewer once in a thousand seeds"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_commands_are_understood(page):
    for line in (*commands(page), *commands(page, "shell")):
        words = shlex.split(line, comments=True)
        if words and words[0].endswith("rig"):
            _parser().parse(words[1:])  # else it ends the program


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)]+)\)", page.read_text("utf-8")):
        place, _, anchor = target.partition("#")
        if place.startswith(("http:", "https:", "mailto:")):
            continue
        there = page.parent / place if place else page
        assert there.exists(), target
        if anchor and there.suffix == ".md":
            heads = re.findall(r"^#+ (.*)$", there.read_text("utf-8"), re.MULTILINE)
            slugs = {re.sub(r"[^\w -]", "", head.lower()).replace(" ", "-") for head in heads}
            assert anchor in slugs, target
