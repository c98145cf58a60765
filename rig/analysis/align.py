"""Which edge is which rod: the cheapest order-preserving matching, gate by gate.

Each observed edge is matched to an expected one of the same polarity, or is extra; each expected
edge is matched or missed. Order is kept, so the cheapest assignment is found by dynamic
programming over (observed, expected), block by block: most edges have one possible partner, which
nobody else may have.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from rig.analysis.chain_records import EdgeTrain
    from rig.analysis.trajectory import Trajectory

    Array = NDArray[np.float64]
    Flags = NDArray[np.bool_]
    Index = NDArray[np.intp]

Item = TypeVar("Item", bound=np.generic)

# Both together are the worth of a match: an edge 6 widths off is better called extra and missed.
MISSED = 9.0
"""Cost of an expected edge that was not seen, in units of ½ (residual/scale)²."""
EXTRA = 9.0
"""Cost of an edge that belongs to no rod."""
_REACH = (2.0 * (MISSED + EXTRA)) ** 0.5  # widths: what is further off is never matched
_ROUNDING = 1e-9  # the way back through the table meets sums made in another order


@dataclass(frozen=True, slots=True)
class Pairing:
    """The edges of one side, ready to be matched again and again.

    Attributes
    ----------
    times, number
        Of every observed edge, gate by gate, and its number in its train.
    kind
        Of each: twice the number of its train, and one more where it darkens the beam.
    blocks
        Whether each expected edge darkens the beam.
    order, kinds
        Expected edges sorted by kind, and the kind of each of these.
    ends
        Number of expected edges after each train.
    """

    times: Array
    number: Index
    kind: Index
    blocks: Flags
    order: Index
    kinds: Index
    ends: Index

    @classmethod
    def of(cls, trains: Sequence[EdgeTrain]) -> Pairing:
        """Take the edges of a side's trains."""
        none = np.zeros(0, dtype=np.bool_)
        blocks = np.concatenate([none, *(train.blocks for train in trains)])
        blocked = np.concatenate([none, *(train.blocked for train in trains)])
        numbers = [np.arange(train.times.size) for train in trains]
        kinds = 2 * np.repeat(np.arange(len(trains)), [train.rods.size for train in trains])
        kinds += blocks
        order = np.argsort(kinds, kind="stable")
        return cls(
            np.concatenate([np.zeros(0), *(train.times for train in trains)]),
            np.concatenate([np.zeros(0, dtype=np.intp), *numbers]),
            2 * np.repeat(np.arange(len(trains)), [one.size for one in numbers]) + blocked,
            blocks,
            order,
            kinds[order],
            np.cumsum([train.rods.size for train in trains], dtype=np.intp),
        )

    def matched(
        self, levels: Array, trajectory: Trajectory, scale: float, clock: float = 0.0
    ) -> list[Index]:
        """Match the edges to rods.

        Parameters
        ----------
        levels
            The height of the reference point at every expected edge of all trains, m.
        trajectory
            Where the chain is believed to be.
        scale
            Standard deviation of the distance between where a chain is when an edge comes and where
            it should be, m.
        clock
            By what share the edges' clock is believed to be slow.

        Returns
        -------
        list of ndarray
            For each train the index of its edge for every expected edge, −1 for a missed one; shape
            ``(expected,)``.
        """
        found = np.full(levels.size, -1, dtype=np.intp)
        heights = trajectory.heights(self.times * (1.0 + clock))[0]
        rows, first, end = self._windows(levels, heights, scale * _REACH)
        # Cut where no edge's choice bears on another's: all later ones begin beyond all earlier.
        later = np.minimum.accumulate(first[::-1])[::-1]
        earlier = np.maximum.accumulate(end)
        cuts = np.flatnonzero(later[1:] >= earlier[:-1]) + 1
        begins = np.concatenate([np.zeros(min(1, rows.size), dtype=np.intp), cuts])
        lengths = np.diff(begins, append=rows.size)
        sole = (lengths == 1) & ((end - first)[begins] == 1)
        found[first[begins[sole]]] = self.number[rows[begins[sole]]]
        for begin, length in zip(begins[~sole].tolist(), lengths[~sole].tolist(), strict=True):
            mine = rows[begin : begin + length]
            its = slice(later[begin], earlier[begin + length - 1])
            costs = 0.5 * ((levels[its] - heights[mine, None]) / scale) ** 2
            costs[self.blocks[its] != self.kind[mine, None] % 2] = np.inf
            # What is left is a few edges: plain lists are quicker here than arrays.
            for row, column in _cheapest(costs.tolist()):
                found[its.start + column] = self.number[mine[row]]
        return split(found, self.ends)

    def _windows(self, levels: Array, heights: Array, reach: float) -> tuple[Index, Index, Index]:
        """Find the expected edges that are near enough to each observed one.

        Returns
        -------
        rows
            The observed edges that have any.
        first, end
            Of each: before `first` there is none, from `end` on neither.
        """
        none = np.zeros(0, dtype=np.intp)
        low = levels.min(initial=np.inf) - 2.0 * reach
        high = levels.max(initial=-np.inf) + 2.0 * reach
        if not np.isfinite(high - low):
            return none, none, none
        # All kinds in one line, further apart than any two edges of a kind; what is later is lower.
        apart = high - low + 2.0 * reach
        line = self.kinds * apart - levels[self.order]
        mine = self.kind * apart - np.clip(heights, low, high)
        # Levels that are not in order open a window, and never close one.
        begin = np.searchsorted(np.maximum.accumulate(line), mine - reach)
        end = np.searchsorted(np.minimum.accumulate(line[::-1])[::-1], mine + reach, side="right")
        rows = np.flatnonzero(end > begin)
        return rows, self.order[begin[rows]], self.order[end[rows] - 1] + 1


def split(line: NDArray[Item], ends: Index) -> list[NDArray[Item]]:
    """Cut a line of all trains' values at the end of each; much quicker than numpy does."""
    stops = ends.tolist()
    return [line[begin:end] for begin, end in zip([0, *stops], stops, strict=False)]


def _cheapest(costs: Sequence[Sequence[float]]) -> list[tuple[int, int]]:
    """Match one block by dynamic programming over (edges, expected)."""
    size = len(costs[0])
    table = [[MISSED * column for column in range(size + 1)]]
    for number, row in enumerate(costs):
        before, best = table[-1], EXTRA * (number + 1)
        line = [best]
        for column, cost in enumerate(row):
            best = min(before[column] + cost, before[column + 1] + EXTRA, best + MISSED)
            line.append(best)
        table.append(line)
    return list(_trace(table, costs))


def _trace(
    table: Sequence[Sequence[float]], costs: Sequence[Sequence[float]]
) -> Iterator[tuple[int, int]]:
    """Walk back through a block's table."""
    row, column = len(costs), len(costs[0])
    while row and column:
        here = table[row][column] + _ROUNDING
        if table[row - 1][column - 1] + costs[row - 1][column - 1] <= here:
            row, column = row - 1, column - 1
            yield row, column
        elif table[row - 1][column] + EXTRA <= here:
            row -= 1
        else:
            column -= 1
