"""README's commands work in their order, those of all pages are understood, and links lead on."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from rig.cli import _parser

ROOT = Path(__file__).parents[1]
PAGES = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "firmware/README.md")),
    *sorted((ROOT / "docs").glob("*.md")),
]


def commands(page: Path, language: str = "sh") -> list[str]:
    """Lines of a page's code blocks; those of ``shell`` need a board, those of ``sh`` do not."""
    block = rf"^```{language}\n(.*?)^```"
    blocks = re.findall(block, page.read_text("utf-8"), re.MULTILINE | re.DOTALL)
    return [line for block in blocks for line in block.splitlines()]


def test_every_command_of_the_readme_works(tmp_path):
    for name in ("run", "protocols"):
        (tmp_path / name).symlink_to(ROOT / name)
    (tmp_path / ".venv").symlink_to(sys.prefix)
    found = commands(ROOT / "README.md")
    assert len(found) >= 5
    said = {}
    for command in found:
        done = subprocess.run(
            command, shell=True, cwd=tmp_path, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
        said[command] = done.stdout
    held, of = re.search(r"([0-9]+) of ([0-9]+) results agree", said["./run demo"]).groups()
    assert int(of) == 18
    assert int(held) >= 14, "at 95 % that is fewer once in a thousand seeds"
    for symbol, hidden in (("β", 0.5), ("μ", 0.2)):
        told = rf"{symbol} ([0-9.]+) ± ([0-9.]+) \(hidden: {hidden}\)"
        found = re.search(told, " ".join(said["./run demo"].split()))
        value, expanded = map(float, found.groups())
        assert abs(value - hidden) < 2 * expanded, "four standard uncertainties"
    assert "g ± U (m/s²)" in said[".venv/bin/rig analyze my.session"]


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
