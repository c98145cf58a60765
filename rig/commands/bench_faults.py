"""``rig bench faults``."""

from __future__ import annotations

from importlib.util import find_spec
from typing import TYPE_CHECKING

from rig.bench.faults import faults
from rig.bench.moments import STATES
from rig.commands.output import print_json, say

if TYPE_CHECKING:
    from argparse import Namespace

    from rig.bench.tally import Tally

_COUNTS = {
    "sim": {
        "daemon": 200,
        "runner": 50,
        "cable": 100,
        "reset": 40,
        "disk": 40,
        "noise": 8,
        "race": 10,
        "deaf": 4,
    },
    # The emulator takes a good part of a core for each rig.
    "emu": {"daemon": 40, "runner": 10, "cable": 20, "reset": 10, "noise": 2},
}


def main(arguments: Namespace) -> int:
    """Kill, pull, reset, fill and garble, and count what was lost."""
    found: dict[str, dict[str, Tally]] = {}
    for board in arguments.boards:
        if board == "emu" and find_spec("rig_emulator") is None:
            say("left out: emu (pip install ./firmware/emulator)")
            continue
        counts = {
            kind: max(1, round(count * arguments.share / 100))
            for kind, count in _COUNTS[board].items()
            if kind in (arguments.kinds or _COUNTS[board])
        }
        if counts:  # not every kind is done to both
            found[board] = faults(counts, arguments.jobs, say, board)
    if arguments.json:
        print_json(
            {
                board: {kind: one.json() for kind, one in kinds.items()}
                for board, kinds in found.items()
            }
        )
    else:
        for board, kinds in found.items():
            _print(board, kinds)
    troubles = [
        f"{board} {kind}: {what}"
        for board, kinds in found.items()
        for kind, tally in kinds.items()
        for what in tally.broken
    ]
    for trouble in troubles:
        say(trouble)
    return 1 if troubles else 0


def _print(board: str, kinds: dict[str, Tally]) -> None:
    names = ("times", *STATES, "sessions", "runs", "drops", "bad frames", "on ms", "off ms", "lost")
    print(f"{board:<7}" + "".join(f"{name:>{_width(name)}}" for name in names))
    for kind, one in kinds.items():
        share = f"{one.bad_frames / max(1, one.frames):.1%}"
        cells: list[object] = [one.disturbed, *(one.fell_upon[state] for state in STATES)]
        cells += [one.sessions, one.runs, one.drops, share]
        cells += [round(one.longest_on_s * 1e3), round(one.off_after_s * 1e3), len(one.broken)]
        print(
            f"{kind:<7}"
            + "".join(f"{cell:>{_width(name)}}" for name, cell in zip(names, cells, strict=True))
        )
    if "disk" in kinds:
        print(f"a full disk: {kinds['disk'].full_disk}")
    if "deaf" in kinds:
        print(f"a daemon nobody read from grew by {kinds['deaf'].memory_bytes / 1e6:.1f} MB")


def _width(name: str) -> int:
    return max(6, len(name)) + 1
