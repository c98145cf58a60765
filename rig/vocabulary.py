"""The words of each scene: a ball has no rods, a glider does not hang, one chain has no other side.

Every sentence that names what falls takes its words from here.
"""

from __future__ import annotations

from dataclasses import dataclass


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


_ROWS = """\
object | the object | the object starts | object | the object, its drop and the gates | holding
track | the glider | the glider starts | glider | the glider, its start and the gates | placing
picket-fence | the fence | the fence starts | bar | the fence, its drop and the gates | holding
free-chain | the chain | the chain hangs | rod | the chain, its drop and the gates | hanging
one-chain | the chain | the chain hangs | rod | chain, drop, incline and gates | hanging
two-chains | the chains | the chains hang | rod | chains, drop, incline and gates | hanging
"""
"""A scene a row; what is done by hand before a drop is done to what falls."""


def _read_row(row: str) -> Vocabulary:
    scene, body, start, part, setup, handling = row.split(" | ")
    two_sides = scene == "two-chains"
    return Vocabulary(scene, body, start, part, setup, f"{handling} {body}", two_sides)


_SCENES = [_read_row(row) for row in _ROWS.splitlines()]
OBJECT, TRACK, FENCE, FREE_CHAIN, ONE_CHAIN, TWO_CHAINS = _SCENES
ANY_SCENE = Vocabulary(
    "", "what falls", "it starts", "part", "your set-up", "preparing it", two_sides=True
)
VOCABULARIES = {words.scene: words for words in (*_SCENES, ANY_SCENE)}
