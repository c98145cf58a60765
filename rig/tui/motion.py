"""Where both chains were during a drop, from its edges, beside where the model has them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.chain_records import EdgeArrays, edge_trains
from rig.analysis.trajectory import free_trajectory, struck_trajectory
from rig.model.fall import kicks
from rig.predictions import air_of, predict_incline
from rig.protocol.contact import at_contact

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from rig.analysis.chain_records import EdgeTrain
    from rig.analysis.trajectory import Trajectory
    from rig.arrays import Array
    from rig.protocol.protocol import Protocol, Run

    Table = Iterable[Sequence[int]] | NDArray[np.int64]

_FIRST = 4
_MOST = 1200  # edges of a drop that is still falling
_POINTS = 120  # of a curve: two a column of a wide terminal


@dataclass(frozen=True, slots=True)
class ChainFall:
    """One chain's way down.

    Attributes
    ----------
    role
        ``impact`` or ``free``.
    times, heights
        Of each rod's edge in a beam: seconds since the release fired, and the height of the bottom
        rod's middle above the contact point that follows, m; in order of time.
    model
        `None` outside the model's domain.
    delay_s
        By how much the model's release is later than the fire stamp, so that it meets the points.
    end_s
        When all of it has struck or passed the last gate, by the model and by the points.
    """

    role: str
    times: Array
    heights: Array
    model: Trajectory | None
    delay_s: float
    end_s: float = 0.0

    def curve(self, end_s: float) -> tuple[Array, Array]:
        """Model's heights from the fire stamp to a time; empty without a model.

        What strikes the surface ends there, with the impact of its top rod.
        """
        if self.model is None:
            return np.empty(0), np.empty(0)
        if self.model.hits is not None:
            end_s = min(end_s, float(self.model.time[-1]) + self.delay_s)
        times = np.linspace(0.0, end_s, _POINTS)
        return times, self.model.heights(times - self.delay_s)[0]


def motions(
    protocol: Protocol,
    run: Run,
    edges: Table,
    hz: float = 1.0,
    matches: Mapping[int, int] | None = None,
) -> tuple[ChainFall, ...]:
    """Turn a drop's edges into heights.

    Parameters
    ----------
    run
        What hung where.
    edges
        Tick, channel and state of each, as they come or as a table of them.
    hz
        Tick rate.
    matches
        Rod of each edge by its number, as the analysis found; without it each edge is taken for the
        rod that the model has nearest the beam then.
    """
    if protocol.gates is None:
        return ()
    protocol = at_contact(protocol, run.incline_deg, run.impact)
    table = edges if isinstance(edges, np.ndarray) else as_table(edges)
    if matches is None:
        table = _thinned(table)
    falls = []
    for role, _, parts in edge_trains(protocol, run, EdgeArrays.of(table, hz)):
        model = model_fall(protocol, run, role)
        if matches is not None:
            pairs = [_matched(part, matches) for part in parts]
        else:
            pairs = _nearest(parts, model)
        times = np.concatenate([times for times, _ in pairs])
        heights = np.concatenate([heights for _, heights in pairs])
        order = np.argsort(times, kind="stable")
        times, heights = times[order], heights[order]
        delay = 0.0
        if model is not None and times.size:
            delay = float(np.median(times - model.times(heights)))
        end = float(times[-1]) if times.size else 0.0
        if model is not None:
            struck = model.hits is not None
            levels = [level for part in parts for level in part.levels.tolist()]
            lowest = np.array([min(levels, default=0.0)])
            end = max(end, delay + float(model.time[-1] if struck else model.times(lowest)[0]))
        falls.append(ChainFall(role, times, heights, model, delay, end))
    return tuple(falls)


def as_table(edges: Iterable[Sequence[int]]) -> NDArray[np.int64]:
    """Take edges as numbers, shape ``(edges, 3)``: tick, channel and state of each."""
    return np.array([tuple(edge) for edge in edges], dtype=np.int64).reshape(-1, 3)


def _thinned(table: NDArray[np.int64]) -> NDArray[np.int64]:
    """Take of very many edges only as many as a picture can show."""
    if len(table) <= _MOST:
        return table
    taken = np.arange(len(table)) % (1 + len(table) // _MOST) == 0
    for channel in np.unique(table[:, 1]):  # where counting has to begin
        taken[np.flatnonzero(table[:, 1] == channel)[:_FIRST]] = True
    thinned: NDArray[np.int64] = table[taken]
    return thinned


def _nearest(parts: Sequence[EdgeTrain], model: Trajectory | None) -> list[tuple[Array, Array]]:
    """Times and heights of each gate's edges before anybody has matched them."""
    counted = [_counted(part, part.times.size) for part in parts]
    if model is None:
        return counted
    # Flicker and missed rods have not shifted the count of the first few yet.
    first = [_counted(part, _FIRST) for part in parts]
    lags = [times - model.times(levels) for times, levels in first if times.size]
    if not lags:
        return counted
    delay = float(np.median(np.concatenate(lags)))
    pairs = []
    for part in parts:
        if not part.levels.size:
            pairs.append(_counted(part, 0))
            continue
        expected = model.heights(part.times - delay)[0]
        off = np.abs(part.levels[None, :] - expected[:, None])
        off[part.blocks[None, :] != part.blocked[:, None]] = np.inf
        pairs.append((part.times, part.levels[off.argmin(axis=1)]))
    return pairs


def _counted(part: EdgeTrain, limit: int) -> tuple[Array, Array]:
    """Take a gate's edges for its rods in order."""
    count = min(part.times.size, part.levels.size, limit)
    return part.times[:count], part.levels[:count]


def _matched(part: EdgeTrain, matches: Mapping[int, int]) -> tuple[Array, Array]:
    """Times and heights of one gate's edges, each with the rod it was matched to."""
    levels = dict(zip(zip(part.rods.tolist(), part.blocks.tolist(), strict=True),
                      part.levels.tolist(), strict=True))  # fmt: skip
    edges = zip(part.edge.tolist(), part.blocked.tolist(), strict=True)
    heights = np.array(
        [levels.get((matches.get(edge, -1), blocked), np.nan) for edge, blocked in edges],
        dtype=np.float64,
    )
    matched = ~np.isnan(heights)
    return part.times[matched], heights[matched]


def model_fall(protocol: Protocol, run: Run, role: str) -> Trajectory | None:
    """Take the prediction's fall of a chain, moment by moment; `None` outside its domain.

    Parameters
    ----------
    role
        ``impact`` or ``free``.
    """
    protocol = at_contact(protocol, run.incline_deg, run.impact)
    start, gravity = protocol.drop.value, protocol.gravity.value
    # A chain that strikes alone is set beside its own free fall.
    name = run.impact if role == "impact" else run.free or run.impact
    assert name is not None
    kappas = air_of(protocol, name) or [0.0] * protocol.chains[name].chain.rods
    if role == "free" or protocol.surface is None:
        return free_trajectory(0.0, start, gravity, kappas[0])
    expected = predict_incline(protocol, run.incline_deg, name)
    if expected.alpha is None or expected.gamma is None:
        return None
    chain = protocol.chains[name].chain
    gains = np.array(kicks(chain, [expected.alpha] * chain.rods, expected.gamma))
    places, air = np.array(chain.heights), np.array([*kappas, kappas[-1]])
    return struck_trajectory(0.0, start, gravity, gains, np.ones(places.size), places, 1.0, air)
