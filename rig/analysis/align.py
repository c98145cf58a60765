"""Which edge is which rod: the cheapest order-preserving matching, gate by gate.

Each observed edge is matched to an expected one of the same polarity, or is extra; each expected
edge is matched or missed. Order is kept, so the cheapest assignment is found by dynamic
programming over (observed, expected), block by block: most edges have one possible partner, which
nobody else may have.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from rig.analysis.trains import Train
    from rig.analysis.trajectory import Trajectory

    Array = NDArray[np.float64]
    Index = NDArray[np.intp]

MISSED = 9.0
"""Cost of an expected edge that was not seen, in units of ½ (residual/scale)²."""
EXTRA = 9.0
"""Cost of an edge that belongs to no rod."""
_ROUNDING = 1e-9


def align(
    trains: Sequence[Train],
    levels: Sequence[Array],
    trajectory: Trajectory,
    scale: float,
    clock: float = 0.0,
) -> list[Index]:
    """Match the edges of one side to rods.

    Parameters
    ----------
    levels
        For each train the height of the reference point at every expected edge, m.
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
    if not trains:
        return []
    heights, _ = trajectory.heights(np.concatenate([t.times for t in trains]) * (1.0 + clock))
    begins = np.cumsum([train.times.size for train in trains])[:-1]
    return [
        _match(_costs(train, level, height, scale))
        for train, level, height in zip(trains, levels, np.split(heights, begins), strict=True)
    ]


def possible(train: Train, trajectory: Trajectory, scale: float, clock: float) -> int:
    """Most expected edges that any matching could match at the nominal levels, see `align`."""
    heights, _ = trajectory.heights(train.times * (1.0 + clock))
    return int(_worth(_costs(train, train.levels, heights, scale)).any(axis=0).sum())


def _costs(train: Train, levels: Array, heights: Array, scale: float) -> Array:
    """Cost of every pairing, shape ``(edges, expected)``; infinite for unlike polarities."""
    distance = (heights[:, None] - levels) / scale
    return np.where(train.blocked[:, None] == train.blocks, 0.5 * distance**2, np.inf)


def _worth(costs: Array) -> NDArray[np.bool_]:
    """Which pairs cost less than a missed and an extra edge: no other is ever matched."""
    return costs < MISSED + EXTRA


def _match(costs: Array) -> Index:
    """Match one gate, shape ``(expected,)``."""
    matched = np.full(costs.shape[1], -1, dtype=np.intp)
    worth = _worth(costs)
    rows = np.flatnonzero(worth.any(axis=1))
    if not rows.size:
        return matched
    first = worth[rows].argmax(axis=1)
    end = worth.shape[1] - worth[rows, ::-1].argmax(axis=1)
    # Cut where no edge's choice bears on another's: all later ones begin beyond all earlier ones.
    later = np.minimum.accumulate(first[::-1])[::-1]
    earlier = np.maximum.accumulate(end)
    cuts = np.concatenate([[0], 1 + np.flatnonzero(later[1:] >= earlier[:-1]), [rows.size]])
    begins, sizes = cuts[:-1], np.diff(cuts)
    sole = (sizes == 1) & ((end - first)[begins] == 1)
    matched[first[begins[sole]]] = rows[begins[sole]]
    for begin, size in zip(begins[~sole].tolist(), sizes[~sole].tolist(), strict=True):
        edges = rows[begin : begin + size]
        left, right = later[begin], earlier[begin + size - 1]
        for row, column in _cheapest(costs[edges, left:right].tolist()):
            matched[left + column] = edges[row]
    return matched


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
