"""Which edge is which rod: the cheapest order-preserving matching, gate by gate.

Each observed edge is matched to an expected one of the same polarity, or is extra; each expected
edge is matched or missed. Order is kept, so the cheapest assignment is found by dynamic
programming over (observed, expected), for all gates of a side at once; gates where every edge has
one possible partner need none.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

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
    costs = [
        _costs(train, level, trajectory, scale, 1.0 + clock)
        for train, level in zip(trains, levels, strict=True)
    ]
    found = [_plain(cost) for cost in costs]
    hard = [gate for gate, match in enumerate(found) if match is None]
    solved = dict(zip(hard, _best([costs[gate] for gate in hard]), strict=True))
    return [solved[gate] if match is None else match for gate, match in enumerate(found)]


def _plain(costs: Array) -> Index | None:
    """Match a gate where every edge has at most one partner; `None` where there is a choice.

    A pair is worth while if it costs less than a missed and an extra edge. Where all such pairs
    are apart and in order, taking all of them is the cheapest of all matchings.
    """
    worth = costs < MISSED + EXTRA
    if costs.size and (worth.sum(axis=0).max() > 1 or worth.sum(axis=1).max() > 1):
        return None
    matched = np.full(costs.shape[1], -1, dtype=np.intp)
    edge, rod = np.nonzero(worth)
    if np.any(np.diff(rod) < 0):
        return None
    matched[rod] = edge
    return matched


def _best(costs: Sequence[Array]) -> list[Index]:
    """Match several gates by dynamic programming, side by side."""
    rows = max((cost.shape[0] for cost in costs), default=0)
    columns = max((cost.shape[1] for cost in costs), default=0)
    stacked = np.full((rows, len(costs), columns), np.inf)
    extra = np.zeros((rows, len(costs)))
    for gate, cost in enumerate(costs):
        stacked[: cost.shape[0], gate, : cost.shape[1]] = cost
        extra[: cost.shape[0], gate] = EXTRA
    misses = MISSED * np.arange(columns + 1)
    table = np.empty((rows + 1, len(costs), columns + 1))
    table[0] = misses
    for row in range(rows):
        best = table[row] + extra[row][:, None]
        np.minimum(best[:, 1:], table[row][:, :-1] + stacked[row], out=best[:, 1:])
        # What is missed on the way adds a constant a column: a running minimum finds the best.
        table[row + 1] = np.minimum.accumulate(best - misses, axis=1) + misses
    return [_trace(table[:, gate], cost) for gate, cost in enumerate(costs)]


def _costs(
    train: Train, levels: Array, trajectory: Trajectory, scale: float, stretch: float
) -> Array:
    """Cost of every pairing, shape ``(edges, expected)``; infinite for unlike polarities."""
    heights, _ = trajectory.heights(train.times * stretch)
    distance = (heights[:, None] - levels[None, :]) / scale
    return np.where(train.blocked[:, None] == train.blocks[None, :], 0.5 * distance**2, np.inf)


def _trace(table: Array, costs: Array) -> Index:
    """Walk back through one gate's table."""
    row, column = costs.shape
    matched = np.full(column, -1, dtype=np.intp)
    while row and column:
        here = table[row, column]
        if table[row - 1, column - 1] + costs[row - 1, column - 1] <= here + _ROUNDING:
            row, column = row - 1, column - 1
            matched[column] = row
        elif table[row - 1, column] + EXTRA <= here + _ROUNDING:
            row -= 1
        else:
            column -= 1
    return matched
