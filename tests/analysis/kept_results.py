"""What the sessions in ``kept/`` give, number by number; ``python -m`` this writes it anew.

They were recorded once, with a simulated board: two chains on a board, over a pile and in air, a
gate that is not where the protocol says, a fence, and a single chain.
"""

import json
import re
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

from rig.cli import main

FOLDER = Path(__file__).parent / "kept"
SESSIONS = {"fence": 0, "gate-off": 3, "piles": 0, "single": 0, "steep": 0}
"""Exit codes of their analyses."""
AGREE = 1e-4
"""Share of a number, or of its standard uncertainty, by which other machines may differ."""


def results(name: str) -> dict[str, Any]:
    """Return what the commands that compute print of a session, after their exit codes."""
    found: dict[str, Any] = {}
    for command in ("analyze", "estimate"):
        out = StringIO()
        with redirect_stdout(out), redirect_stderr(StringIO()):
            code = main([command, str(FOLDER / f"{name}.session"), "--json", "--fresh"])
        found[command] = [code, json.loads(out.getvalue() or "null")]
    return found


def differences(new: Any, old: Any, place: str = "", u: float = 0.0) -> list[str]:
    """List the places at which results differ, by more than `AGREE` where they are numbers."""
    if isinstance(new, dict) and isinstance(old, dict) and new.keys() == old.keys():
        u = max([x for x in (new.get("u"), new.get("found")) if isinstance(x, float)], default=0.0)
        return [x for key in new for x in differences(new[key], old[key], f"{place} {key}", u)]
    if isinstance(new, list) and isinstance(old, list) and len(new) == len(old):
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
    return re.sub(r"[\[{][^\[\]{}]*[]}]", lambda group: " ".join(group[0].split()), text) + "\n"


if __name__ == "__main__":
    for name in SESSIONS:
        (FOLDER / f"{name}.json").write_text(_text(results(name)), "utf-8")
