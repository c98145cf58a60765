"""What commands give of sessions and scenes that are kept, number by number.

Each file of ``kept/`` holds command lines, and of each the exit code and what it gave. Python's
``-m`` this carries all out again and writes them anew; a command that is to be kept too is written
into a file by hand, with `null` beside it.

The sessions were recorded once, with a simulated board: two chains on a board, over a pile and in
air, unlike and with a coefficient of their own; a single chain from several heights; a fence on two
rigs, and blind; a ball. Of `faults` and `faults-2` each drop is another rig's, wrong in one
thing; of `limits` each is beyond another limit, one was rejected and one repeated.
"""

import csv
import json
import re
import shlex
from contextlib import chdir, redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest

from rig.cli import main

FOLDER = Path(__file__).parent / "kept"
NAMES = sorted(path.stem for path in FOLDER.glob("*.json"))
AGREE = 1e-4
"""Share of a number, or of its standard uncertainty, by which other machines may differ."""


def kept(name: str) -> dict[str, Any]:
    """Read what is kept in a file, by command."""
    return json.loads((FOLDER / f"{name}.json").read_text("utf-8"))


def results(name: str) -> dict[str, Any]:
    """Carry out the commands of a file: exit code, and JSON, rows of a table or lines of text."""
    with TemporaryDirectory() as place, chdir(FOLDER), pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", place)
        return {command: _outcome(shlex.split(command), Path(place)) for command in kept(name)}


def _outcome(words: list[str], place: Path) -> tuple[int, Any]:
    out, table = StringIO(), place / "table.csv"
    written = ["-o", str(table)] if {"sweep", "--figure"} & {*words} else []
    with redirect_stdout(out), redirect_stderr(StringIO()):
        code = main([*words, *written])
    if written:
        lines = table.read_text("utf-8").splitlines()
        rows = csv.reader(line for line in lines if not line.startswith("#"))
        return code, [[_cell(text) for text in row] for row in rows]
    if "--json" in words:
        return code, json.loads(out.getvalue() or "{}")
    return code, out.getvalue().splitlines()


def _cell(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def differences(new: Any, old: Any, place: str = "", u: float = 0.0) -> list[str]:
    """List the places at which results differ, by more than `AGREE` where they are numbers."""
    if isinstance(new, dict) and isinstance(old, dict) and new.keys() == old.keys():
        u = max([x for x in (new.get("u"), new.get("found")) if isinstance(x, float)], default=0.0)
        return [x for key in new for x in differences(new[key], old[key], f"{place} {key}", u)]
    if isinstance(new, list | tuple) and isinstance(old, list) and len(new) == len(old):
        pairs = enumerate(zip(new, old, strict=True))
        return [x for n, pair in pairs for x in differences(*pair, f"{place} {n}", u)]
    if isinstance(new, float) and isinstance(old, float | int):
        alike = abs(new - old) <= AGREE * max(abs(new), abs(old), u)
    else:
        alike = new == old
    return [] if alike else [f"{place.strip()}: {new}, {old} before"]


def _text(found: dict[str, Any]) -> str:
    """Write results without digits that say nothing, and each group of numbers in a line."""
    rounded = json.loads(
        json.dumps(found), parse_float=lambda digits: float(f"{float(digits):.7g}")
    )
    text = json.dumps(rounded, ensure_ascii=False, indent=1)
    return re.sub(r"[\[{][^\[\]{}]*[]}]", lambda group: re.sub(r"\n *", " ", group[0]), text) + "\n"


if __name__ == "__main__":
    for name in NAMES:
        (FOLDER / f"{name}.json").write_text(_text(results(name)), "utf-8")
