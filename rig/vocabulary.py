"""The words of each scene: a ball has no rods, a glider does not hang, one chain has no other side.

Every sentence that names what falls takes its words from here.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Vocabulary:
    """The words of one kind of scene.

    Attributes
    ----------
    scene
        Its name, as ``rig new --scene`` has it.
    body
        What falls.
    start
        What it does before the release, with its subject.
    part
        What a beam sees of it.
    setup
        What to compare with the protocol where nothing more is known.
    reset
        What is done by hand before each drop.
    two_sides
        Whether gates and chains are told apart by their side.
    """

    scene: str
    body: str
    start: str
    part: str
    setup: str
    reset: str
    two_sides: bool = False


def _read_row(row: str) -> Vocabulary:
    scene, body, start, part, setup, handling = row.split(" | ")
    two_sides = scene == "two-chains"
    return Vocabulary(scene, body, start, part, setup, f"{handling} {body}", two_sides)


_ROWS = Path(__file__).with_suffix(".txt").read_text("utf-8").splitlines()
_SCENES = [_read_row(row) for row in _ROWS if not row.startswith("#")]
OBJECT, TRACK, FENCE, FREE_CHAIN, ONE_CHAIN, TWO_CHAINS = _SCENES
ANY_SCENE = Vocabulary(
    "", "what falls", "it starts", "part", "your set-up", "preparing it", two_sides=True
)
VOCABULARIES = {words.scene: words for words in (*_SCENES, ANY_SCENE)}
