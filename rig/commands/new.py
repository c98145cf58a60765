"""``rig new``: a protocol from a few answers, with drawings and four simulated drops."""

import sys
import tempfile
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from rig.boards import BOARDS, GATES
from rig.commands.output import Arguments, print_results
from rig.files import check_new, write_atomic
from rig.predictions import notes
from rig.protocol import reader
from rig.protocol.describe import describe
from rig.protocol.draft import SCENES, Draft, Scene, draft_text
from rig.protocol.measurable import check_recordable
from rig.reasons import rig_error
from rig.report.canvas import figure_file
from rig.report.mounting import mounting_figure
from rig.report.wiring import wiring_drawing
from rig.runner import Operator, run_protocol
from rig.streams import ask, say
from rig.text_rows import read_rows, read_text

_CHOICE = read_text(__file__, "choose.txt")
"""What somebody has, the ready protocol for it, and the command; README begins with it too."""
_MOST = {"gates": GATES, "rods": 1000, "repeats": 1000}
"""The largest number that an option accepts."""


def main(arguments: Arguments) -> int:
    """Write a protocol, draw and describe it, and try it in simulation."""
    path: Path = arguments.output
    drawings = ("mounting", "wiring")
    places = {word: check_new(path.with_name(f"{path.stem}-{word}.svg")) for word in drawings}
    board, draft = _read_answers(arguments, path)
    text = draft_text(draft)
    protocol = reader.parse(text, str(path))
    check_recordable(protocol, BOARDS.get(board))
    texts: dict[str, str | bytes] = {"protocol": text}
    texts["mounting"] = figure_file(mounting_figure(protocol), "svg")
    if board in BOARDS:
        texts["wiring"] = wiring_drawing(protocol, board)
    with ExitStack() as undo:  # a disk that is full half-way is left as it was
        for word, content in texts.items():
            write_atomic(places.get(word, path), content)
            undo.callback(places.get(word, path).unlink)
        undo.pop_all()
    say("\n".join(f"{word}: {places.get(word, path)}" for word in texts))
    print(describe(protocol, notes(protocol)))
    print("\nFour simulated drops")
    return _simulate(draft)


def _read_answers(arguments: Arguments, path: Path) -> tuple[str, Draft]:
    """Return the board and the draft; ask for what the command line leaves open."""
    if arguments.scene is None and _can_ask(arguments):
        say(f"What have you got?\n{_CHOICE.replace('`', '')}")
    word = _ask(arguments, "scene", "What do you drop?", "object", SCENES)
    scene: Scene = next(name for name in SCENES if name == word)
    answers: dict[str, Any] = {}
    rows = read_rows(__file__)
    fitting = [row for row in rows if not row[0] or scene in row[0].split()]
    for option in {row[1] for row in rows} - {row[1] for row in fitting}:
        if getattr(arguments, option) is not None:
            raise rig_error("not_in_scene", option=option, name=scene)
    for where, option, question, usual, *words in rows:
        here = not where or {scene, answers.get("aim")} & {*where.split()}
        if here and option not in answers:
            answers[option] = _ask(arguments, option, question, usual, " ".join(words).split())
    answers = {"rods": "1", "length": "", "incline": ""} | answers
    for option, limit in _MOST.items():
        if not _is_count(text := answers[option], limit):
            raise rig_error("no_such_number", option=option, text=text, limit=limit)
        answers[option] = int(text)
    title = arguments.title or path.stem.replace("-", " ").replace("_", " ")
    sizes = {name: answers[name] for name in Draft._fields if name in answers}
    return answers["board"], Draft(title=title, scene=scene, inclines=answers["incline"], **sizes)


def _can_ask(arguments: Arguments) -> bool:
    return not arguments.yes and sys.stdin.isatty()


def _ask(arguments: Arguments, option: str, words: str, usual: str, accepted: Sequence[str]) -> str:
    """Return the answer of the command line or of the user, or the default.

    `accepted` is empty where any answer is.
    """
    value = getattr(arguments, option)
    if value is not None:
        return str(value)
    if not _can_ask(arguments):
        say(f"{words} {usual} (--{option})")
        return usual
    choice, most = f" ({', '.join(accepted)})" if accepted else "", _MOST.get(option, 0)
    while True:
        answer = ask(f"{words}{choice} [{usual}] ") or usual
        if answer in accepted or _is_count(answer, most) or not (most or accepted):
            return answer
        say(f"  accepted: {', '.join(accepted) or f'a whole number from 1 to {most}'}")


def _is_count(text: str, limit: int) -> bool:
    return text.isdecimal() and 1 <= int(text) <= limit


def _simulate(draft: Draft) -> int:
    """Simulate four drops of the drafted scene, and print the results."""
    with tempfile.TemporaryDirectory() as folder:
        protocol, session = (Path(folder) / f"trial.{end}" for end in ("yaml", "session"))
        write_atomic(protocol, draft_text(draft.trial()))
        results = run_protocol(str(protocol), "sim://", str(session), Operator(say), 1)
        return print_results(results, as_json=False)
