"""``rig new``: a protocol from a few answers, drawn, described, and tried with four drops."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from rig.boards import BOARDS, GATES
from rig.commands.output import print_results
from rig.errors import InputError
from rig.files import write_atomic
from rig.predictions import notes
from rig.protocol import reader
from rig.protocol.describe import describe
from rig.protocol.draft import SCENES, STRUCK, Draft, draft_text
from rig.protocol.measurable import check_recordable
from rig.ready import WIRED, wiring_picture
from rig.recorder.interrupts import Interrupts
from rig.report.canvas import write_figure
from rig.report.mounting import mounting_figure
from rig.runner import Operator, run_protocol
from rig.streams import ask, say

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Mapping

    from rig.protocol.draft import Scene

_OTHER = "other"
_AIMS = {
    "separation": "40 deg",
    "coefficients": "30 deg, 40 deg, 50 deg, 60 deg, 70 deg",
}
"""What is to be learned, and the inclines for that where none are given."""


class _Question(NamedTuple):
    """One question: its option, its words, the answer without one, and which are accepted."""

    option: str
    words: str
    usual: str
    accepted: tuple[str, ...] = ()


def main(arguments: Namespace) -> int:
    """Write a protocol, draw and describe it, and try it in simulation."""
    path = Path(arguments.output)
    mounting, wiring = (
        path.with_name(f"{path.stem}-{what}.svg") for what in ("mounting", "wiring")
    )
    for one in (path, mounting, wiring):
        if one.exists():
            raise InputError(f"{one} is there already", "name a new file, or move that one away")
    if path.suffix not in {".yaml", ".yml"}:
        raise InputError(f"{path}: a protocol is a file ending in .yaml")
    board, draft = _answers(arguments, path)
    text = draft_text(draft)
    protocol = reader.parse(text, str(path))
    check_recordable(protocol, BOARDS.get(board))
    write_atomic(path, text)
    say(f"protocol: {path}")
    assert protocol.gates is not None
    write_figure(mounting, mounting_figure(protocol, protocol.gates))
    say(f"mounting: {mounting}")
    if board in WIRED:
        write_atomic(wiring, wiring_picture(board).read_text("utf-8"))
        say(f"wiring: {wiring}")
    print(describe(protocol, notes(protocol)))
    print("\nFour drops in simulation")
    return _tried(draft)


def _answers(arguments: Namespace, path: Path) -> tuple[str, Draft]:
    """Ask for whatever the command line does not say, where somebody can answer."""
    scene = _asked(
        arguments, _Question("scene", "What falls?", "object", tuple(SCENES)), explained=SCENES
    )
    board = _asked(arguments, _Question("board", "Which timer?", "pico", (*BOARDS, _OTHER)))
    struck, body = scene in STRUCK, scene in {"object", "track"}
    fence = scene == "picket-fence"
    gates = _asked(arguments, _Question("gates", "How many gates?", "2" if fence else "4"))
    rods, length = "1", ""
    if not body:
        what = "bars" if fence else "rods in a chain"
        rods = _asked(arguments, _Question("rods", f"How many {what}?", "8" if fence else "25"))
        words = "How long, from the middle of the lowest to the middle of the highest?"
        length = _asked(arguments, _Question("length", words, "350 mm" if fence else "1165 mm"))
    thick = {"object": "20 mm", "track": "100 mm", "picket-fence": "25 mm"}.get(scene, "12.7 mm")
    words = "How long is it in a beam, along its way?" if body else "How thick is one, upright?"
    diameter = _asked(arguments, _Question("diameter", words, thick))
    inclines = ""
    if struck:
        aim = _asked(arguments, _Question("aim", "What is to be learned?", "separation", (*_AIMS,)))
        words = "At which inclines of the board?"
        inclines = _asked(arguments, _Question("incline", words, _AIMS[aim]))
    elif scene == "track":
        words = "How steep is the track?"
        inclines = _asked(arguments, _Question("incline", words, "3 deg ± 0.1 deg"))
    drops = {"track": "1500 mm ± 1 mm", "object": "900 mm ± 1 mm", "picket-fence": "400 mm ± 2 mm"}
    words = "How high above the contact point does it hang?" if struck else "From how high?"
    drop = _asked(arguments, _Question("drop", words, drops.get(scene, "180 mm ± 2 mm")))
    repeats = _asked(arguments, _Question("repeats", "How many drops of a kind?", "12"))
    title = arguments.title or path.stem.replace("-", " ").replace("_", " ")
    chosen: Scene = next(one for one in SCENES if one == scene)
    return board, Draft(
        title, chosen, _count("gates", gates, GATES), _count("rods", rods), length, diameter, drop,
        inclines, _count("repeats", repeats),
    )  # fmt: skip


def _asked(
    arguments: Namespace, question: _Question, explained: Mapping[Scene, str] | None = None
) -> str:
    """Take an answer from the command line, or ask, or take the usual one."""
    said = getattr(arguments, question.option)
    if said is not None:
        return str(said)
    if arguments.yes or not sys.stdin.isatty():
        say(f"{question.words} {question.usual} (--{question.option})")
        return question.usual
    for word, meaning in (explained or {}).items():
        say(f"  {word:14} {meaning}")
    choice = f" ({', '.join(question.accepted)})" if question.accepted and not explained else ""
    while True:
        answer = ask(f"{question.words}{choice} [{question.usual}] ") or question.usual
        if not question.accepted or answer in question.accepted:
            return answer
        say(f"  accepted: {', '.join(question.accepted)}")


def _count(name: str, said: str, most: int = 1000) -> int:
    if not said.isdecimal() or not 1 <= int(said) <= most:
        raise InputError(f"--{name}: found {said}; a whole number from 1 to {most} is wanted")
    return int(said)


def _tried(draft: Draft) -> int:
    """Let the drafted scene fall four times in simulation, and print what is measured."""
    interrupts = Interrupts()
    with tempfile.TemporaryDirectory() as folder, interrupts.caught():
        protocol, session = (Path(folder) / f"trial.{end}" for end in ("yaml", "session"))
        write_atomic(protocol, draft_text(draft.trial()))
        found = run_protocol(str(protocol), "sim://", str(session), Operator(say), 1, interrupts)
        return print_results(found, as_json=False)
