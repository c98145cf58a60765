"""Every point of a grid, computed in pieces by any executor, always to the same bits.

The coefficients of Eq. 9 are found here and the falls by the executor. Coefficients rest on sines,
whose last digit differs between processors; a fall is made of sums, products, quotients and square
roots, which are the same everywhere. Nor does a point depend on its neighbours, so neither how the
grid is cut nor who computes a piece can be seen in the results.
"""

from collections import deque
from collections.abc import Callable, Mapping
from concurrent.futures import Executor, Future
from itertools import islice
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Array, Flags
from rig.model.batch import Impacts, falls, given_impacts, surface_impacts
from rig.model.chain import XI
from rig.sweep.layout import Layout

_Numbers = float | Array
NOT_SLIDING, ABOVE_HALF, NO_ANSWER, PILE = 1, 2, 4, 8
NOTES = {
    NOT_SLIDING: "the rod does not slide",
    ABOVE_HALF: "α is above ½",
    NO_ANSWER: "no answer: Eq. 13 is singular",
    PILE: "rods gather on a pile: level, with the pile's own restitution",
}
"""Meaning of each bit of a point's notes; all but the last leave the model's domain."""

_RODS_IN_CHUNK = 2_500_000  # 30 ms or so: nobody waits long for a running piece to end
_LONGEST_CHUNK = 100_000  # of chains of few rods: a piece's coefficients are made in one go


class Swept(NamedTuple):
    """Results at every point; all arrays have the shape of the grid.

    Attributes
    ----------
    separation_m, speed_m_s
        Δz and V as in `rig.model.fall.Fall`, the longer free chain counted; `NaN` where there is
        no answer.
    notes
        Sum of the bits in `NOTES` that apply.
    """

    separation_m: Array
    speed_m_s: Array
    notes: NDArray[np.uint8]

    @property
    def in_domain(self) -> Flags:
        """Where nothing leaves the model's domain."""
        inside: Flags = (self.notes & ~np.uint8(PILE)) == 0
        return inside


def chunk_length(rods: int) -> int:
    """Return how many falls make one piece of work."""
    return max(1, min(_LONGEST_CHUNK, _RODS_IN_CHUNK // rods))


def compute(
    layout: Layout,
    executor: Executor,
    slots: int,
    length: int,
    show: Callable[[int], None] = lambda _done: None,
) -> Swept:
    """Compute a sweep.

    Parameters
    ----------
    layout
        What to compute.
    executor
        Who computes the falls.
    slots
        How many pieces may be under way together; bounds the memory they take.
    length
        Points of a piece, as from `chunk_length`.
    show
        Called with the number of points done after each piece.
    """
    size, chain = layout.size, layout.chain
    separation, speed, notes = np.empty(size), np.empty(size), np.empty(size, np.uint8)

    def submit(place: slice) -> tuple[slice, Future[Array]]:
        values = layout.fixed_values | layout.along_axes(place)
        impacts = _impacts(layout, values)
        notes[place] = _notes(layout, values, impacts)
        inputs = values["drop"], values["gravity"], values.get("initial_speed", 0.0)
        return place, executor.submit(falls, chain.masses, chain.heights, impacts, *inputs)

    pieces, under_way = map(submit, layout.chunks(length)), deque[tuple[slice, Future[Array]]]()
    try:
        under_way.extend(islice(pieces, slots))
        while under_way:
            place, future = under_way.popleft()
            separation[place], speed[place], _ = future.result()
            under_way.extend(islice(pieces, 1))
            show(place.stop)
    finally:
        for _, future in under_way:
            future.cancel()
    separation += layout.longer_m
    notes[np.isnan(separation)] = NO_ANSWER
    shape = layout.shape
    return Swept(separation.reshape(shape), speed.reshape(shape), notes.reshape(shape))


def _impacts(layout: Layout, values: Mapping[str, _Numbers]) -> Impacts:
    if "alpha" in values:
        return given_impacts(values["alpha"], values["gamma"])
    return surface_impacts(
        values["incline"],
        values["restitution"],
        values["friction"],
        XI * values["inertia"],
        inertia_z=layout.chain.inertia_z,
        gamma=values.get("gamma"),
        pile=layout.pile,
    )


def _notes(layout: Layout, values: Mapping[str, _Numbers], impacts: Impacts) -> NDArray[np.uint8]:
    flags = NOT_SLIDING * ~impacts.sliding
    flags |= ABOVE_HALF * (impacts.alpha > 0.5)
    if layout.pile is not None:
        flags = flags | PILE * np.less(values["incline"], layout.pile.below_deg)
    return flags.astype(np.uint8)
