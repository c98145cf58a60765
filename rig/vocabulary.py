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


OBJECT = Vocabulary(
    "object",
    "the object",
    "the object starts",
    "object",
    "the object, its drop and the gates",
    "holding the object",
)
TRACK = Vocabulary(
    "track",
    "the glider",
    "the glider starts",
    "glider",
    "the glider, its start and the gates",
    "placing the glider",
)
FENCE = Vocabulary(
    "picket-fence",
    "the fence",
    "the fence starts",
    "bar",
    "the fence, its drop and the gates",
    "holding the fence",
)
FREE_CHAIN = Vocabulary(
    "free-chain",
    "the chain",
    "the chain hangs",
    "rod",
    "the chain, its drop and the gates",
    "hanging the chain",
)
ONE_CHAIN = Vocabulary(
    "one-chain",
    "the chain",
    "the chain hangs",
    "rod",
    "chain, drop, incline and gates",
    "hanging the chain",
)
TWO_CHAINS = Vocabulary(
    "two-chains",
    "the chains",
    "the chains hang",
    "rod",
    "chains, drop, incline and gates",
    "hanging the chains",
    two_sides=True,
)
ANY_SCENE = Vocabulary(
    "", "what falls", "it starts", "part", "your set-up", "preparing it", two_sides=True
)
VOCABULARIES = {
    words.scene: words
    for words in (OBJECT, TRACK, FENCE, FREE_CHAIN, ONE_CHAIN, TWO_CHAINS, ANY_SCENE)
}
