"""``rig bench faults``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.bench.faults import faults
from rig.commands.output import print_json, say

if TYPE_CHECKING:
    from argparse import Namespace

_FULL = {"daemon": 200, "runner": 50, "cable": 100, "reset": 20, "noise": 8}
_HEADINGS = ("disturbed", "sessions", "runs", "drops", "broken", "longest on (ms)")


def main(arguments: Namespace) -> int:
    """Kill, pull, reset and garble, and count what was lost."""
    counts = {kind: max(1, count * arguments.share // 100) for kind, count in _FULL.items()}
    found = faults(counts, arguments.jobs, say)
    if arguments.json:
        print_json({kind: tally.json() for kind, tally in found.items()})
    else:
        print(" " * 8 + "".join(f"{name:>17}" for name in _HEADINGS))
        for kind, tally in found.items():
            cells = (tally.disturbed, tally.sessions, tally.runs, tally.drops, len(tally.broken))
            row = "".join(f"{cell:>17}" for cell in cells)
            print(f"{kind:<8}{row}{tally.longest_on_s * 1e3:>17.0f}")
    for kind, tally in found.items():
        for what in tally.broken:
            say(f"{kind}: {what}")
    return 1 if any(tally.broken for tally in found.values()) else 0
