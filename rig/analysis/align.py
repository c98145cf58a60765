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

    from rig.analysis.chain_records import EdgeTrain
    from rig.analysis.trajectory import Trajectory

    Array = NDArray[np.float64]
    Index = NDArray[np.intp]

# Both together are the worth of a match: an edge 6 widths off is better called extra and missed.
MISSED = 9.0
"""Cost of an expected edge that was not seen, in units of ½ (residual/scale)²."""
EXTRA = 9.0
"""Cost of an edge that belongs to no rod."""
_ROUNDING = 1e-9  # the way back through the table meets sums made in another order


def align(
    trains: Sequence[EdgeTrain],
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
    costs, sizes = _costs(trains, levels, trajectory, scale, clock)
    matched = _match(costs, sizes).reshape(len(trains), -1)
    return [row[:size] for row, size in zip(matched, sizes[0], strict=True)]


def possible(train: EdgeTrain, trajectory: Trajectory, scale: float, clock: float) -> int:
    """Most expected edges that any matching could match at the nominal levels, see `align`."""
    costs, _ = _costs([train], [train.levels], trajectory, scale, clock)
    return int(_worth(costs).any(axis=0).sum())


def _costs(
    trains: Sequence[EdgeTrain],
    levels: Sequence[Array],
    trajectory: Trajectory,
    scale: float,
    clock: float,
) -> tuple[Array, Index]:
    """Cost of every pairing of an edge and an expected edge of its gate, and how many there are.

    Returns
    -------
    costs
        Shape ``(edges of all gates, most expected edges of a gate)``; infinite for unlike
        polarities and beyond a gate's expected edges.
    sizes
        Expected and observed edges of each gate, shape ``(2, gates)``.
    """
    sizes = np.array([[t.rods.size for t in trains], [t.times.size for t in trains]])
    wide, gates = int(sizes[0].max()), np.arange(len(trains))
    gate = np.repeat(gates, sizes[0])
    place = np.concatenate([np.arange(size) for size in sizes[0]])
    blocks = np.concatenate([train.blocks for train in trains])
    expected = np.full((gates.size, 2, wide), np.inf)  # of either polarity
    expected[gate, blocks.astype(np.intp), place] = np.concatenate(levels)
    blocked = np.concatenate([train.blocked for train in trains])
    # One row of expected levels a gate and polarity: an unlike polarity costs infinity by itself.
    like = 2 * np.repeat(gates, sizes[1]) + blocked
    times = np.concatenate([train.times for train in trains]) * (1.0 + clock)
    distance = expected.reshape(2 * gates.size, wide)[like]
    distance -= trajectory.heights(times)[0][:, None]
    distance /= scale
    return 0.5 * distance**2, sizes


def _worth(costs: Array) -> NDArray[np.bool_]:
    """Which pairs cost less than a missed and an extra edge: no other is ever matched."""
    return costs < MISSED + EXTRA


def _match(costs: Array, sizes: Index) -> Index:
    """Match all gates, see `_costs`; shape ``(gates · most expected edges of a gate,)``."""
    gates, wide = sizes.shape[1], costs.shape[1]
    matched = np.full(gates * wide, -1, dtype=np.intp)
    if not costs.size:
        return matched
    worth = _worth(costs)
    first = worth.argmax(axis=1)
    rows = np.flatnonzero(worth[np.arange(first.size), first])
    if not rows.size:
        return matched
    gate = np.repeat(np.arange(gates), sizes[1])[rows]
    begins_at = np.cumsum(sizes[1]) - sizes[1]  # a gate's edges are numbered by themselves
    number = rows - begins_at[gate]
    # All gates' expected edges in one line, so that gates are cut apart like everything else.
    first = first[rows] + gate * wide
    end = (gate + 1) * wide - worth[rows, ::-1].argmax(axis=1)
    # Cut where no edge's choice bears on another's: all later ones begin beyond all earlier ones.
    later = np.minimum.accumulate(first[::-1])[::-1]
    earlier = np.maximum.accumulate(end)
    cuts = np.concatenate([[0], 1 + np.flatnonzero(later[1:] >= earlier[:-1]), [rows.size]])
    begins, lengths = cuts[:-1], np.diff(cuts)
    sole = (lengths == 1) & ((end - first)[begins] == 1)
    matched[first[begins[sole]]] = number[begins[sole]]
    for begin, length in zip(begins[~sole].tolist(), lengths[~sole].tolist(), strict=True):
        edges = slice(begin, begin + length)
        left, right = int(later[begin]), int(earlier[begin + length - 1])
        base = gate[begin] * wide
        block = costs[rows[edges], left - base : right - base]
        # What is left is a few edges: plain lists are quicker here than arrays.
        for row, column in _cheapest(block.tolist()):
            matched[left + column] = number[begin + row]
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
