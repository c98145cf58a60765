"""A protocol file from a few answers, with comments, and gates at suitable heights."""

import json
from collections.abc import Mapping, Sequence
from itertools import count, pairwise
from typing import Literal, NamedTuple, Self, get_args

from jinja2 import Environment, StrictUndefined

from rig.errors import InputError
from rig.protocol.keys import KEYS
from rig.protocol.protocol import Protocol, Side
from rig.protocol.reader import parse
from rig.reasons import rig_error
from rig.text_rows import read_rows, read_text

Scene = Literal["two-chains", "one-chain", "object", "track", "picket-fence"]
SCENES: tuple[Scene, ...] = get_args(Scene)

_PLACES = {
    name: [[*map(float, place.split())] for place in places]
    for name, *places in read_rows(__file__, "draft_gates.txt")
}
"""Where gates go, in order of importance."""
_CLEAR = 1.5e-3
_FIRST = 0.06  # share of a single object's path before its first gate
_LAST = 0.1  # height of the lowest gate as a share of the drop height


class Draft(NamedTuple):
    """Answers about a set-up, in the notation of a protocol file.

    Attributes
    ----------
    rods, length, diameter
        Properties of a chain or a picket fence; for a single object only `diameter`, its length in
        a beam.
    inclines
        Inclines of the board, or the incline of the track.
    gates
        Number of gates.
    """

    title: str
    scene: Scene
    gates: int
    rods: int
    length: str
    diameter: str
    drop: str
    inclines: str
    repeats: int

    def trial(self) -> Self:
        """Return the draft with four drops, at the middle incline."""
        inclines = self.inclines.strip(" ,").split(",")
        return self._replace(inclines=inclines[len(inclines) // 2].strip(), repeats=4)


def draft_text(draft: Draft) -> str:
    """Return the text of the protocol.

    Raises
    ------
    InputError
        The answers do not make a protocol; lists the fault of each.
    """
    try:
        bare = parse(_text(draft, {}), draft.title)
    except InputError as error:
        messages = [f"{problem.key}: {problem.message}" for problem in error.problems]
        raise InputError("; ".join(messages) or str(error), "rig new --help") from None
    text = _text(draft, _gates(bare, draft))
    parse(text, draft.title)
    return text


_TEMPLATES = Environment(trim_blocks=True, undefined=StrictUndefined)  # noqa: S701 - no page


def _text(draft: Draft, gates: Mapping[Side, Sequence[tuple[int, float]]]) -> str:
    """Return the text of the file with these gates; defaults are those of the table of keys."""
    values = draft._asdict() | {"title": json.dumps(draft.title, ensure_ascii=False)}
    return _TEMPLATES.from_string(read_text(__file__)).render(values, gates=gates, keys=KEYS) + "\n"


def _gates(protocol: Protocol, draft: Draft) -> dict[Side, list[tuple[int, float]]]:
    """Return channels and heights (m) of gates that hanging rods leave clear, the lowest first."""
    place, channels = _low_and_high if protocol.surface else _even, count()
    return {
        side: [(next(channels), height) for height in sorted(place(protocol, side, number))]
        for side, number in _share_gates(draft).items()
    }


def _share_gates(draft: Draft) -> dict[Side, int]:
    """Return the number of gates on each side; with few gates, most on the free side."""
    if draft.scene != "two-chains":
        return {"impact" if draft.scene == "one-chain" else "free": draft.gates}
    if draft.gates < 2:
        raise rig_error("gates_too_few")
    impact = 1 if draft.gates < 5 else draft.gates // 2
    return {"impact": impact, "free": draft.gates - impact}


def _low_and_high(protocol: Protocol, side: Side, number: int) -> list[float]:
    """Return heights of low gates for the end of a fall, and of some between hanging rods, m."""
    (rods, *_), drop = protocol.chains.values(), protocol.drop
    half = max(rods.widths) / 2.0
    low = half + _CLEAR
    way = drop.value - half - max(_CLEAR, drop.u) - low
    heights = [max(low, min(meant, low + share * way)) for meant, share in _PLACES[side][:number]]
    gaps = [
        drop.value + (low + high) / 2.0
        for low, high in pairwise(rods.chain.heights)
        if high - low > 2.0 * (half + max(_CLEAR, drop.u))
    ]
    for (share,) in _PLACES["between"][: min(number - len(heights), len(gaps))]:
        target = drop.value + share * rods.chain.length
        _, gap = min((abs(gap - target), gap) for gap in gaps)
        gaps.remove(gap)
        heights.append(gap)
    if len(heights) < number:
        raise rig_error("gates_too_many", gates=number, fitting=len(heights))
    return heights


def _even(protocol: Protocol, _: Side, number: int) -> list[float]:
    """Return even heights from near the lowest level up to just below the start, m."""
    (body,), drop = protocol.chains.values(), protocol.drop
    clear = max(body.widths) / 2.0 + max(_CLEAR, drop.u)
    first = drop.value - max(clear + _CLEAR, _FIRST * drop.value)
    last = _LAST * drop.value
    return [last + n * (first - last) / max(number - 1, 1) for n in range(number)]
