"""The words of each scene: a ball has no rods, a glider does not hang, one chain has no other side.

Every sentence that names what falls takes its words from here.
"""

from typing import NamedTuple

from rig.text_rows import read_rows


class Vocabulary(NamedTuple):
    """The words of one kind of scene, a row of ``vocabulary.txt``.

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
        Empty unless gates and chains are told apart by their side.
    """

    scene: str
    body: str
    start: str
    part: str
    setup: str
    reset: str
    two_sides: str


_SCENES = [Vocabulary(*cells) for cells in read_rows(__file__)]
OBJECT, TRACK, FENCE, FREE_CHAIN, ONE_CHAIN, TWO_CHAINS, ANY_SCENE = _SCENES
VOCABULARIES = {words.scene: words for words in _SCENES}
