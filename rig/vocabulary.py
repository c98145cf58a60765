"""The words of each scene: a ball has no rods, a glider does not hang, one chain has no other side.

Every sentence that names what falls takes its words from here.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from rig.text_rows import read_rows


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


def _vocabulary(cells: Iterable[str]) -> Vocabulary:
    scene, body, start, part, setup, handling = cells
    two_sides = scene == "two-chains"
    return Vocabulary(scene, body, start, part, setup, f"{handling} {body}", two_sides)


_SCENES = [*map(_vocabulary, read_rows(__file__))]
OBJECT, TRACK, FENCE, FREE_CHAIN, ONE_CHAIN, TWO_CHAINS = _SCENES
ANY_SCENE = Vocabulary(
    "", "what falls", "it starts", "part", "your set-up", "preparing it", two_sides=True
)
VOCABULARIES = {words.scene: words for words in (*_SCENES, ANY_SCENE)}
