"""``rig new``: a protocol from a few answers, with drawings and four simulated drops."""

from __future__ import annotations

import sys
import tempfile
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rig.boards import BOARDS, GATES
from rig.commands.output import print_results
from rig.errors import InputError
from rig.files import write_atomic
from rig.predictions import notes
from rig.protocol import reader
from rig.protocol.describe import describe
from rig.protocol.draft import SCENES, Draft, Scene, draft_text
from rig.protocol.measurable import check_recordable
from rig.ready import WIRED
from rig.recorder.interrupts import Interrupts
from rig.report.canvas import write_figure
from rig.report.mounting import mounting_figure
from rig.report.wiring import wiring_drawing
from rig.runner import Operator, run_protocol
from rig.streams import ask, say

_COEFFICIENTS = "coefficients"
_SIZES = ("gates", "rods", "length", "diameter", "drop", "repeats")
"""Answers that a draft takes as they are."""
_MANY_INCLINES = "30 deg, 40 deg, 50 deg, 60 deg, 70 deg"
"""Where the coefficients are to be measured, if no inclines are given."""
_CHOICE = Path(__file__).with_name("choose.txt").read_text("utf-8")
"""What somebody has, the ready protocol for it, and the command; README begins with it too."""


def main(arguments: Namespace) -> int:
    """Write a protocol, draw and describe it, and try it in simulation."""
    path = Path(arguments.output)
    mounting, wiring = (
        path.with_name(f"{path.stem}-{drawing}.svg") for drawing in ("mounting", "wiring")
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
    if arguments.scene is None and _can_ask(arguments):
        say(f"What have you got?\n{_CHOICE.replace('`', '')}")
    word = _ask(arguments, "scene", "What do you drop?", "object", SCENES)
    scene: Scene = next(name for name in SCENES if name == word)
    answers: dict[str, Any] = {"rods": "1", "length": "", "incline": ""}
    lines = Path(__file__).with_suffix(".txt").read_text("utf-8").splitlines()
    rows = (map(str.strip, line.split("|")) for line in lines if not line.startswith("#"))
    for scenes, option, question, usual in rows:
        if scenes and scene not in scenes.split():
            continue
        many = option == "incline" and answers.get("aim") == _COEFFICIENTS
        default = _MANY_INCLINES if many else usual
        words = {"board": (*BOARDS, "other"), "aim": (usual, _COEFFICIENTS)}.get(option, ())
        answers[option] = _ask(arguments, option, question, default, words)
    for option, limit in {"gates": GATES, "rods": 1000, "repeats": 1000}.items():
        answers[option] = _count(option, answers[option], limit)
    title = arguments.title or path.stem.replace("-", " ").replace("_", " ")
    inclines, sizes = answers["incline"], {name: answers[name] for name in _SIZES}
    return answers["board"], Draft(title=title, scene=scene, inclines=inclines, **sizes)


def _can_ask(arguments: Namespace) -> bool:
    return not arguments.yes and sys.stdin.isatty()


def _ask(arguments: Namespace, option: str, words: str, usual: str, accepted: Sequence[str]) -> str:
    """Return the answer of the command line or of the user, or the default.

    `accepted` is empty where any answer is.
    """
    value = getattr(arguments, option)
    if value is not None:
        return str(value)
    if not _can_ask(arguments):
        say(f"{words} {usual} (--{option})")
        return usual
    choice = f" ({', '.join(accepted)})" if accepted else ""
    while True:
        answer = ask(f"{words}{choice} [{usual}] ") or usual
        if not accepted or answer in accepted:
            return answer
        say(f"  accepted: {', '.join(accepted)}")


def _count(name: str, text: str, limit: int) -> int:
    if not text.isdecimal() or not 1 <= int(text) <= limit:
        raise InputError(f"--{name}: found {text}; accepted: a whole number from 1 to {limit}")
    return int(text)


def _simulate(draft: Draft) -> int:
    """Simulate four drops of the drafted scene, and print the results."""
    interrupts = Interrupts()
    with tempfile.TemporaryDirectory() as folder, interrupts.caught():
        protocol, session = (Path(folder) / f"trial.{end}" for end in ("yaml", "session"))
        write_atomic(protocol, draft_text(draft.trial()))
        results = run_protocol(str(protocol), "sim://", str(session), Operator(say), 1, interrupts)
        return print_results(results, as_json=False)
