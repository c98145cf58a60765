"""Assignment of edges to rods: a mixture likelihood of a side's edges, annealed.

An edge at a gate is a rod's side of its polarity, or clutter. With the height h between an edge and
a rod's side, it belongs to that side with the weight (1 − m) N(h; 0, σ) / (λ/v + (1 − m) Σ N).
σ starts at a part of the rods' spacing and halves to its final value over a few Gauss-Newton steps.
These fit the unknowns that move a chain as a whole; many falls are fitted as an array. Starts are
the points of a grid of the unknowns at which most edges agree, the likeliest first.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from rig.analysis.chain_records import ChainRecord, EdgeTrain
from rig.analysis.components import ALPHA_SD, ANY_ALPHA
from rig.analysis.departures import LOWEST_START
from rig.analysis.free_flight import FAINT
from rig.analysis.trajectory import (
    COMMON,
    GRAVITY,
    ONE,
    Trajectory,
    free_trajectory,
    struck_trajectory,
)
from rig.analysis.unknowns import ANY_GRAVITY, prior_air
from rig.arrays import Array, Index
from rig.protocol.protocol import Protocol

MISSED = 0.02
"""Prior probability that an expected edge is missed."""
STRAYS = 2.0
"""Prior rate of stray edges at a gate, 1/s."""
RELEASE, START, CLOCK, PULL, DRAG, ALPHA, UNKNOWNS = range(7)
"""Columns of a fall's unknowns: release time, start height, clock rate, g, κ, α; their number."""
PART = 6.0
"""Least spacing of two rods over σ of the first step: narrow enough to resolve neighbours."""
_BROADER = 2.0
"""Ratio of σ in the last step to its own value: allows for errors common to a beam or rod."""
_STEPS = 12
_FAR = 2.5
"""Radius of the grid of starts in prior standard uncertainties: 99 % of drops as stated."""
_RECORD = 4.0
"""Longest part of a record that is searched, s: no fall lasts longer. It has the most edges."""
_NODES = 400
_BATCH = 8  # grid points of the first batch
PEAKS = 5
"""Starts of a batch that are annealed."""
_ALIKE = 0.75
"""Share of equally assigned edges above which two starts converge to the same fall."""
LEAST = 0.6
"""Least share of the expected edges that a fall must explain. Also the least share of the best
start's votes with which another start is tried."""


def matched(match: Index) -> tuple[Index, Index]:
    """Return the expected edges that are matched, and the observed edge of each."""
    pick = np.flatnonzero(match >= 0)
    return pick, match[pick]


def log_density(off: Array, sigma: Array | float, speed: Array) -> Array:
    """Return the log likelihood ratio of each edge as a rod's edge against a stray.

    The reference is a reading in which all edges are strays and every rod was missed.

    Parameters
    ----------
    off, sigma
        Height between edge and rod's side, and its standard deviation, m.
    speed
        Speed of the rod, m/s.
    """
    worth = math.log((1.0 - MISSED) / MISSED / STRAYS / math.sqrt(2.0 * math.pi))
    tiny = np.finfo(float).tiny
    return np.log(np.maximum(speed, tiny) / sigma) - 0.5 * (off / sigma) ** 2 + worth


class Weights(NamedTuple):
    """The two rods' sides nearest to each edge, with weights; shape ``(falls, edges, 2)``.

    Attributes
    ----------
    side
        Number of the expected edge.
    off
        Height between the edge and that side, m.
    sigma
        Standard deviation of `off`, m.
    weight
        Probability that the edge belongs to the side; 0 if there is no side of its kind.
    """

    side: Index
    off: Array
    sigma: Array
    weight: Array


@dataclass(frozen=True)
class Pairing:
    """The observed and expected edges of one side, prepared for repeated matching.

    Attributes
    ----------
    times, burst
        Time and burst of every observed edge, see `rig.analysis.chain_records.EdgeTrain`.
    kind
        Kind of each: twice the number of its train, plus 1 if it darkens the beam.
    lasting
        Duration of the shadow that each is an end of, s; 0 if it is of none.
    kinds
        Kind of every expected edge.
    longest
        Length of the longest shadow that every expected edge may be an end of, m.
    """

    times: Array
    burst: Array
    kind: Index
    lasting: Array
    kinds: Index
    longest: Array

    @classmethod
    def of(cls, trains: Sequence[EdgeTrain], top_shadow: float = math.inf) -> Pairing:
        """Return the pairing of a side's trains.

        Parameters
        ----------
        top_shadow
            Length of the longest shadow that belongs to the top rod, m.
        """
        none = np.zeros(0, dtype=np.intp)
        rods, kind, kinds = (
            np.concatenate([none, *values])
            for values in (
                [train.rods for train in trains],
                [2 * n + train.blocked for n, train in enumerate(trains)],
                [2 * n + train.blocks for n, train in enumerate(trains)],
            )
        )
        times, burst = (
            np.concatenate([np.zeros(0), *values])
            for values in ([train.times for train in trains], [train.burst for train in trains])
        )
        lasting = np.zeros(times.size)
        begins = np.flatnonzero((kind[1:] == kind[:-1] - 1) & (kind[:-1] % 2 > 0))
        lasting[begins] = lasting[begins + 1] = times[begins + 1] - times[begins]
        longest = np.where(rods == rods.max(initial=0), top_shadow, math.inf)
        return cls(times, burst, kind, lasting, kinds, longest)

    @cached_property
    def pairs(self) -> tuple[Index, Index]:
        """All pairs of an observed and an expected edge of the same gate and polarity."""
        edge, side = np.nonzero(self.kind[:, None] == self.kinds)
        return edge, side

    def weights(
        self, levels: Array, heights: Array, speeds: Array, sigma: Array | float
    ) -> Weights:
        """Return the weights of the two nearest sides of rods, above and below each edge.

        Parameters
        ----------
        levels, sigma
            The height of the reference point at every expected edge, m, and its standard deviation;
            shape ``(expected,)``.
        heights, speeds
            Height and speed of the chains at each observed edge; shape ``(…, edges)``.
        """
        low, high = levels.min(initial=np.inf), levels.max(initial=-np.inf)
        room = high - low + 1.0  # m; separates kinds by more than any two edges of a kind
        line = self.kinds * (3.0 * room) + levels
        order = np.argsort(line)
        heights = np.clip(heights, low - 0.5 * room, high + 0.5 * room)
        after = np.searchsorted(line[order], self.kind * (3.0 * room) + heights)
        side = order[np.clip(np.stack([after - 1, after], axis=-1), 0, line.size - 1)]
        off = heights[..., None] - levels[side]
        width = np.broadcast_to(sigma, levels.shape)[side]
        far = np.where(self.kinds[side] == self.kind[:, None], off / width, 40.0)
        far[..., 1] = np.where(side[..., 0] == side[..., 1], 40.0, far[..., 1])
        # A chain at rest causes no edges: its density is zero.
        density = speeds[..., None] * np.exp(-0.5 * far * far) / width
        clutter = STRAYS * math.sqrt(2.0 * math.pi) / (1.0 - MISSED)
        return Weights(side, off, width, density / (clutter + density.sum(-1, keepdims=True)))

    def chosen(self, weights: Weights, speeds: Array) -> Index:
        """Match edges and rods' sides one to one, where the weight is above ½.

        Parameters
        ----------
        weights, speeds
            Weights and speeds of a single fall.

        Returns
        -------
        ndarray
            The observed edge of every expected edge, −1 if missed; shape ``(expected,)``.
        """
        # A rebounding top rod lengthens its shadow, and no later rod helps to separate the two.
        short = (self.lasting * speeds)[:, None] <= self.longest[weights.side]
        edges, which = np.nonzero(short & (weights.weight > 0.5))
        # Of several edges the nearest, in units of σ, is written last and so stays.
        far = np.abs(weights.off[edges, which]) / weights.sigma[edges, which]
        order = np.argsort(-far, kind="stable")
        edge_of = np.full(self.kinds.size, -1)
        edge_of[weights.side[edges, which][order]] = edges[order]
        return edge_of

    def match(self, levels: Array, heights: Array, speeds: Array, scale: Array) -> Index:
        """Match the edges to rods.

        Parameters
        ----------
        levels
            The height of the reference point at every expected edge of all trains, m.
        heights, speeds
            Height and speed of the chain at each observed edge, by the current fit.
        scale
            Standard deviation of the height between an edge and its level, m; shape
            ``(expected,)``.

        Returns
        -------
        ndarray
            The observed edge for every expected edge, −1 if missed; shape ``(expected,)``.
        """
        if not levels.size or not self.times.size:
            return np.full(levels.size, -1)
        return self.chosen(self.weights(levels, heights, speeds, scale), speeds)


class FallFit(NamedTuple):
    """An annealed fall with its matched edges.

    Attributes
    ----------
    values
        The fall's unknowns, shape ``(UNKNOWNS,)``: release, s since it fired; start, m; rate by
        which the edges' clock is slow; g, m/s²; κ, 1/m; α of all impacts.
    match
        Observed edge of every expected edge, −1 if missed.
    evidence
        Logarithm of the marginal likelihood, relative to all edges being strays.
    scatter
        Root mean square of the edges' residuals, in σ.
    """

    values: Array
    match: Index
    evidence: float
    scatter: float

    @property
    def matches(self) -> list[Index]:
        """`match` in a list, as of a drop with a single side."""
        return [self.match]

    @property
    def match_count(self) -> int:
        """Number of edges matched to a rod."""
        return int(np.count_nonzero(self.match >= 0))


@dataclass(frozen=True)
class SideFall:
    """Model of a chain's fall with few unknowns, for annealing.

    A fall is an array of the unknowns in units of their prior uncertainties, as deviations from the
    stated values; many falls have the shape ``(falls, UNKNOWNS)``.

    Attributes
    ----------
    record, pairing
        The chain, and the edges of its trains.
    stated
        The unknowns' values by the protocol, shape ``(UNKNOWNS,)``.
    sd
        Prior standard uncertainty of each unknown, shape ``(UNKNOWNS,)``; 0 if known exactly, and
        1 s for the release, which has no prior.
    sigma
        Standard deviation of each expected edge from all other errors, m; not needed for votes.
    """

    record: ChainRecord
    pairing: Pairing
    stated: Array
    sd: Array
    sigma: Array

    @classmethod
    def of(
        cls,
        protocol: Protocol,
        record: ChainRecord,
        pairing: Pairing,
        clock_u: float,
        sigma: Array = ONE,
    ) -> SideFall:
        """Return the model of a side with the protocol's values and priors."""
        stated, sd = np.zeros(UNKNOWNS), np.zeros(UNKNOWNS)
        stated[START], stated[PULL] = protocol.drop.value, protocol.gravity.value
        stated[ALPHA], (stated[DRAG], sd[DRAG]) = record.alpha, prior_air(protocol)
        sd[RELEASE], sd[START] = 1.0, math.hypot(protocol.drop.u, protocol.priors.hang)
        sd[CLOCK] = clock_u
        sd[PULL] = ANY_GRAVITY if protocol.surface is None else protocol.gravity.u
        if record.ratios is not None:
            sd[ALPHA] = ALPHA_SD
        return cls(record, pairing, stated, sd, sigma)

    @cached_property
    def levels(self) -> Array:
        """Level of every expected edge, m."""
        return np.concatenate([train.levels for train in self.record.trains])

    @cached_property
    def slack(self) -> float:
        """Standard deviation of the first step, m: a part of the least spacing of two rods."""
        return self.record.pitch / PART

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of the unknowns: drag and gravity stay positive."""
        low, high = np.full(UNKNOWNS, -np.inf), np.full(UNKNOWNS, np.inf)
        low[START] = LOWEST_START - self.stated[START]
        low[PULL] = -0.9 * self.stated[PULL]
        low[DRAG] = FAINT - self.stated[DRAG]  # below FAINT, formulas without drag apply
        low[ALPHA], high[ALPHA] = ANY_ALPHA - np.clip(self.stated[ALPHA], *ANY_ALPHA)
        exact = self.sd == 0.0
        unit = np.where(exact, 1.0, self.sd)
        return np.where(exact, -np.inf, low / unit), np.where(exact, np.inf, high / unit)

    @cached_property
    def _by(self) -> Array:
        """Derivatives of a trajectory's parameters by the unknowns, without those of time."""
        rods = 0 if self.record.ratios is None else self.record.ratios.size
        by = np.zeros((COMMON + 2 * rods, UNKNOWNS))
        by[[1, GRAVITY, 3], [START, PULL, DRAG]] = 1.0
        by[COMMON : COMMON + rods, ALPHA] = 1.0
        return by * self.sd

    def values(self, falls: Array) -> Array:
        """Return the unknowns' values in SI units, shaped like `falls`."""
        values: Array = self.stated + falls * self.sd
        return values

    def path(self, falls: Array) -> Trajectory:
        """Return the trajectories of falls released at time zero."""
        record = self.record
        _, start, _, gravity, kappa, alpha = self.values(falls).T[..., None]
        if record.ratios is None:
            return free_trajectory(0.0, start, gravity, kappa, record.air)
        strikes = record.strikes
        gains = alpha + np.zeros(strikes.size)
        return struck_trajectory(
            0.0, start, gravity, gains, record.ratios, strikes, kappa, record.air
        )

    def since(self, falls: Array, times: Array) -> Array:
        """Return the true time since the release for stamped times, s.

        The clock's rate counts from the release: over hours since the fire, rate and release time
        could not be separated.
        """
        rate: Array = 1.0 + falls[:, CLOCK, None] * self.sd[CLOCK]
        return (times - falls[:, RELEASE, None]) * rate

    def sights(self, falls: Array) -> tuple[Array, Array, Array]:
        """Return heights and speeds at each edge, and derivatives by all unknowns.

        Returns
        -------
        ndarray, ndarray, ndarray
            m, m/s; shape ``(falls, edges)``, and ``(falls, edges, UNKNOWNS)``.
        """
        since = self.since(falls, self.pairing.times)
        height, speed, slopes = self.path(falls).sights(since, self._by)
        # The clock's rate may be taken as 1 in these derivatives.
        slopes[..., RELEASE], slopes[..., CLOCK] = speed, -speed * since * self.sd[CLOCK]
        return height, speed, slopes

    def anneal(self, falls: Array, close: float = np.inf) -> list[FallFit]:
        """Anneal falls and match their edges.

        Parameters
        ----------
        falls
            Starting points.
        close
            Log odds behind the best fall beyond which a fall is dropped.
        """
        own, (low, high) = np.minimum(_BROADER * self.sigma, self.slack), self.bounds
        prior = np.diag(np.where(np.arange(UNKNOWNS) == RELEASE, 1e-9, 1.0))
        y = np.clip(falls, low, high)
        for step in range(_STEPS):
            width = np.maximum(own, self.slack * 0.5**step)
            height, speed, slopes = self.sights(y)
            weights = self.pairing.weights(self.levels, height, speed, width)
            part, taken = weights.weight / weights.sigma**2, weights.weight.sum(axis=2)
            across = np.swapaxes(slopes, 1, 2)
            matrix = (across * part.sum(axis=2)[:, None, :]) @ slopes + prior
            gradient = (across @ (part * weights.off).sum(axis=2)[..., None])[..., 0] + y @ prior
            change = _solve_bounded(matrix, gradient, y - high, y - low)
            lasting, done = np.ones(len(y), dtype=np.bool_), False
            if (width <= own).all():  # at wider σ a fall may still converge
                likely = -np.log1p(-np.minimum(taken, 1.0 - 1e-12)).sum(axis=1)
                lasting = likely >= likely.max() - close
                size = (change[:, None] @ matrix @ change[..., None])[:, 0, 0]
                done = bool((size[lasting] < 1.0).all())
            if done or step == _STEPS - 1:
                break
            # Limit a step to the current σ.
            moved = (slopes @ change[..., None])[..., 0] * (taken > 0.5)
            longest = np.abs(moved).max(axis=1, initial=1e-9)
            change *= np.minimum(1.0, width.max() / longest)[:, None]
            y = np.clip(y - change, low, high)[lasting]
        lost = 0.5 * ((y @ prior) * y).sum(axis=1) + 0.5 * np.linalg.slogdet(matrix)[1]
        return [
            self._match_fall(
                y[n], Weights(*(part[n] for part in weights)), height[n], speed[n], lost[n]
            )
            for n in np.flatnonzero(lasting)
        ]

    def _match_fall(
        self, fall: Array, weights: Weights, height: Array, speed: Array, lost: float
    ) -> FallFit:
        """Match a fall's edges one to one, and compute its evidence."""
        edges = self.pairing.chosen(weights, speed)
        sides = np.flatnonzero(edges >= 0)
        sigma = np.minimum(_BROADER * self.sigma, self.slack)[sides]
        off = height[edges[sides]] - self.levels[sides]
        evidence = float(log_density(off, sigma, speed[edges[sides]]).sum() - lost)
        scatter = math.sqrt(float(((off / sigma) ** 2).sum()) / max(1, sides.size))
        values = self.values(fall)
        values[RELEASE] *= 1.0 + values[CLOCK]
        return FallFit(values, edges, evidence if math.isfinite(evidence) else -math.inf, scatter)

    def nodes(self) -> Array:
        """Return the grid of starting points, the likeliest first.

        The grid is fine enough that, with the release free, every fall is within the first step's
        σ of a grid point.
        """
        low, high = self.bounds
        stated = np.clip(np.zeros((1, UNKNOWNS)), low, high)
        path = self.path(stated)
        times = path.times(self.levels)[0]
        _, begin, slopes = (part[0] for part in path.sights(times, self._by))
        slopes[:, CLOCK] = -begin * times * self.sd[CLOCK]
        slopes -= np.outer(begin, begin @ slopes) / max(float(begin @ begin), 1e-12)
        effects = np.abs(slopes).max(axis=0, initial=0.0) / (2.0 * self.slack)
        grid = stated
        for name in (START, CLOCK, PULL, DRAG, ALPHA):
            if steps := int(_FAR * effects[name] + 0.5):
                axis = np.arange(-steps, steps + 1) / max(effects[name], steps / _FAR)
                grid = np.repeat(grid, axis.size, axis=0)
                grid[:, name] += np.tile(axis, len(grid) // axis.size)
                # Points outside the radius cannot come back inside with further unknowns.
                unlikely = (grid * grid).sum(axis=1)
                order = np.argsort(unlikely, kind="stable")[:_NODES]
                grid = grid[order[unlikely[order] <= _FAR**2 + 1e-9]]
        return np.asarray(grid[((grid >= low) & (grid <= high)).all(axis=1)])

    def starts(self, earliest: float, least: float) -> Iterator[Array]:
        """Yield starting points on which most edges agree, one array for each batch of the grid.

        Parameters
        ----------
        earliest
            Earliest possible release, s.
        least
            Least number of votes of a start.

        Yields
        ------
        ndarray
            Falls in descending order of votes.
        """
        nodes, size = self.nodes(), _BATCH
        while len(nodes):
            batch, nodes = nodes[:size], nodes[size:]
            size *= 2
            falls, votes = self._count_votes(batch, earliest)
            enough = (votes > 0) & (votes >= max(least, LEAST * votes.max(initial=0)))
            order = np.flatnonzero(enough)[np.argsort(-votes[enough], kind="stable")][: 4 * PEAKS]
            yield falls[order[self._unlike(falls[order])] if order.size else order]

    def most_votes(self) -> int:
        """Return the most votes for any fall of the grid's first, likeliest batch."""
        return int(self._count_votes(self.nodes()[:_BATCH])[1].max(initial=0))

    def most_matches(self) -> int:
        """Return how many edges agree, each with a side of its own, with the fall of most votes."""
        falls, votes = self._count_votes(self.nodes()[:_BATCH])
        fall, (edge, side) = falls[np.argsort(-votes)[:1]], self.pairing.pairs
        heights = self.path(fall).heights(self.since(fall, self.pairing.times))[0]
        near = (np.abs(heights[:, edge] - self.levels[side]) <= self.slack).any(axis=0)
        return min(np.unique(edge[near]).size, np.unique(side[near]).size)

    def _count_votes(self, nodes: Array, earliest: float = -np.inf) -> tuple[Array, Index]:
        """Count, for each grid point, the edges that agree on a release time (Hough transform).

        Returns
        -------
        ndarray, ndarray
            The `PEAKS` releases of each node with the most votes, and their votes.
        """
        path, rate = self.path(nodes), 1.0 + nodes[:, CLOCK, None] * self.sd[CLOCK]
        late, early = (path.times(self.levels + off) / rate for off in (-self.slack, self.slack))
        times, lasts = np.sort(self.pairing.times), (late - early)[late > early]
        if not times.size or not lasts.size:
            return nodes[:0], np.zeros(0, dtype=np.intp)
        # A record may last hours: search the window with most edges.
        until = np.searchsorted(times, times + _RECORD, side="right")
        first = int(np.argmax(until - np.arange(times.size)))
        begin = max(float(times[first] - late.max()), earliest)
        end = float(times[until[first] - 1] - early.min())
        if end < begin:
            return nodes[:0], np.zeros(0, dtype=np.intp)
        # Two bins for each vote at the fastest passage.
        step = float(lasts.min()) / 2.0
        bins = int((end - begin) / step) + 2
        came = np.rint(np.clip((self.pairing.times - begin) / step, -1e9, 1e9)).astype(np.intp)
        edge, side = self.pairing.pairs
        votes = np.zeros(len(nodes) * (bins + 1), dtype=np.intp)
        for lasted, sign in ((late, 1), (early, -1)):
            place = came[edge] - np.rint(lasted / step).astype(np.intp)[:, side]
            np.clip(place, 0, bins, out=place)
            place += (bins + 1) * np.arange(len(nodes))[:, None]
            votes += sign * np.bincount(place.ravel(), minlength=votes.size)
        table = np.cumsum(votes.reshape(len(nodes), -1), axis=1)
        # Peaks closer than the rods' spacing at the fastest passage are the same fall.
        row, near = np.arange(len(nodes)), np.arange(-int(PART / 2.0), int(PART / 2.0) + 1)
        falls, counts = np.repeat(nodes[None], PEAKS, axis=0), []
        for peak in falls:
            at = table.argmax(axis=1)
            counts.append(table[row, at])
            # Use the middle of a plateau of equal votes.
            ends = [
                np.argmin(line[n:] == line[n]) for line, n in zip(table, at.tolist(), strict=True)
            ]
            middle = at + np.maximum(np.array(ends) - 1, 0) // 2
            peak[:, RELEASE] = begin + step * (middle + 0.5)
            table[row[:, None], np.clip(middle[:, None] + near, 0, bins)] = 0
        return falls.reshape(-1, UNKNOWNS), np.concatenate(counts)

    def _unlike(self, falls: Array) -> list[int]:
        """Return the first falls whose assignment of edges differs from that of all before."""
        chosen: list[int] = []
        height, speed = self.path(falls).heights(self.since(falls, self.pairing.times))
        side, _, _, weight = self.pairing.weights(self.levels, height, speed, self.slack)
        rods = np.where(weight > 0.5, side, -1).max(axis=2)
        for n, sides in enumerate(rods):
            alike = ((rods[chosen] == sides) & (sides >= 0)).sum(axis=1)
            if len(chosen) < PEAKS and (alike <= _ALIKE * (sides >= 0).sum()).all():
                chosen.append(n)
        return chosen


def _solve_bounded(matrix: Array, gradient: Array, low: Array, high: Array) -> Array:
    """Solve for Newton steps within bounds: clip those outside, then solve for the others."""
    change = np.linalg.solve(matrix, gradient[..., None])[..., 0]
    held = (change < low) | (change > high)
    if held.any():
        fixed = np.where(held, np.clip(change, low, high), 0.0)
        gradient = np.where(held, fixed, gradient - (matrix @ fixed[..., None])[..., 0])
        free = ~held[:, :, None] & ~held[:, None, :]
        matrix = np.where(free, matrix, np.eye(UNKNOWNS))
        change = np.linalg.solve(matrix, gradient[..., None])[..., 0]
    return np.asarray(change)
