"""``rig new``: a protocol from a few answers, with drawings and four simulated drops."""

from __future__ import annotations

import sys
import tempfile
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from rig.boards import BOARDS, GATES
from rig.commands.output import print_results
from rig.errors import InputError
from rig.files import write_atomic
from rig.predictions import notes
from rig.protocol import reader
from rig.protocol.describe import describe
from rig.protocol.draft import SCENES, STRUCK, Draft, draft_text
from rig.protocol.measurable import check_recordable
from rig.ready import WIRED
from rig.recorder.interrupts import Interrupts
from rig.report.canvas import write_figure
from rig.report.mounting import mounting_figure
from rig.report.wiring import wiring_drawing
from rig.runner import Operator, run_protocol
from rig.streams import ask, say

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Mapping

    from rig.protocol.draft import Scene

_OTHER = "other"
_INCLINES = {"coefficients": "30 deg, 40 deg, 50 deg, 60 deg, 70 deg"}
"""What is measured at several inclines, and these if none are given."""


_DROPS = {
    "object": "the zero of the gate heights to its middle",
    "track": "the lower mark to its middle, along the track",
    "picket-fence": "the zero of the gate heights to the lowest bar",
}
"""Where the drop of a scene without a surface is measured."""


def main(arguments: Namespace) -> int:
    """Write a protocol, draw and describe it, and try it in simulation."""
    path = Path(arguments.output)
    mounting, wiring = (
        path.with_name(f"{path.stem}-{what}.svg") for what in ("mounting", "wiring")
    )
    for file in (path, mounting, wiring):
        if file.exists():
            raise InputError(f"{file} already exists", "name a new file, or move this file away")
    if path.suffix not in {".yaml", ".yml"}:
        raise InputError(f"{path}: the name of a protocol ends in .yaml")
    board, draft = _read_answers(arguments, path)
    text = draft_text(draft)
    protocol = reader.parse(text, str(path))
    check_recordable(protocol, BOARDS.get(board))
    write_atomic(path, text)
    say(f"protocol: {path}")
    assert protocol.gates is not None
    write_figure(mounting, mounting_figure(protocol, protocol.gates))
    say(f"mounting: {mounting}")
    if board in WIRED:
        write_atomic(wiring, wiring_drawing(protocol, board))
        say(f"wiring: {wiring}")
    print(describe(protocol, notes(protocol)))
    print("\nFour simulated drops")
    return _simulate(draft)


def _read_answers(arguments: Namespace, path: Path) -> tuple[str, Draft]:
    """Return the board and the draft; ask for what the command line leaves open."""
    answer = partial(_ask, arguments)
    scene = answer("scene", "What do you drop?", "object", SCENES)
    board = answer("board", "Which board times it?", "pico", dict.fromkeys((*BOARDS, _OTHER), ""))
    struck, body = scene in STRUCK, scene in {"object", "track"}
    fence = scene == "picket-fence"
    part = "bar" if fence else "rod"
    gates = answer("gates", "How many gates?", "2" if fence else "4")
    rods, length = "1", ""
    if not body:
        parts = "bars of the fence" if fence else "rods of a chain"
        rods = answer("rods", f"How many {parts}?", "8" if fence else "25")
        words = f"Distance from the middle of the lowest {part} to that of the highest?"
        length = answer("length", words, "350 mm" if fence else "1165 mm")
    thick = {"object": "20 mm", "track": "100 mm", "picket-fence": "25 mm"}.get(scene, "12.7 mm")
    words = "Its length in a beam, along its path?" if body else f"Height of one {part}?"
    diameter = answer("diameter", words, thick)
    inclines = ""
    if struck:
        result = "separation" if scene == "two-chains" else "speed"
        aims = dict.fromkeys((result, *_INCLINES), "")
        aim = answer("aim", "What do you want to measure?", result, aims)
        inclines = answer("incline", "Inclines of the board?", _INCLINES.get(aim, "40 deg"))
    elif scene == "track":
        inclines = answer("incline", "Incline of the track?", "3 deg ± 0.1 deg")
    drops = {"track": "1500 mm ± 1 mm", "object": "900 mm ± 1 mm", "picket-fence": "400 mm ± 2 mm"}
    start = "Start" if scene == "track" else "Drop height"
    words = f"{start}, from {_DROPS.get(scene, 'the contact point to the lowest rod')}?"
    drop = answer("drop", words, drops.get(scene, "180 mm ± 2 mm"))
    repeats = answer("repeats", f"How many drops{' at each incline' if struck else ''}?", "12")
    title = arguments.title or path.stem.replace("-", " ").replace("_", " ")
    chosen: Scene = next(name for name in SCENES if name == scene)
    return board, Draft(
        title, chosen, _count("gates", gates, GATES), _count("rods", rods), length, diameter, drop,
        inclines, _count("repeats", repeats),
    )  # fmt: skip


def _ask(
    arguments: Namespace,
    option: str,
    words: str,
    usual: str,
    accepted: Mapping[Scene, str] | Mapping[str, str] = MappingProxyType({}),
) -> str:
    """Return the answer of the command line or of the user, or the default.

    `accepted` is empty where any answer is; an answer with a meaning has a line of its own.
    """
    value = getattr(arguments, option)
    if value is not None:
        return str(value)
    if arguments.yes or not sys.stdin.isatty():
        say(f"{words} {usual} (--{option})")
        return usual
    meanings = [f"  {word:14} {meaning}" for word, meaning in accepted.items() if meaning]
    for line in meanings:
        say(line)
    choice = f" ({', '.join(accepted)})" if accepted and not meanings else ""
    while True:
        answer = ask(f"{words}{choice} [{usual}] ") or usual
        if not accepted or answer in accepted:
            return answer
        say(f"  accepted: {', '.join(accepted)}")


def _count(name: str, text: str, most: int = 1000) -> int:
    if not text.isdecimal() or not 1 <= int(text) <= most:
        raise InputError(f"--{name}: found {text}; accepted: a whole number from 1 to {most}")
    return int(text)


def _simulate(draft: Draft) -> int:
    """Simulate four drops of the drafted scene, and print the results."""
    interrupts = Interrupts()
    with tempfile.TemporaryDirectory() as folder, interrupts.caught():
        protocol, session = (Path(folder) / f"trial.{end}" for end in ("yaml", "session"))
        write_atomic(protocol, draft_text(draft.trial()))
        results = run_protocol(str(protocol), "sim://", str(session), Operator(say), 1, interrupts)
        return print_results(results, as_json=False)
