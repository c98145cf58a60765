"""Which edge is which rod: one likelihood of a side's edges, annealed from wide to narrow.

An edge at a gate is a rod's side of its polarity or clutter, and all sides compete for it: with the
height h by which an edge misses a side, it belongs to that side with the weight
(1 − m) N(h; 0, σ) / (λ/v + (1 − m) Σ N). σ falls from a part of the rods' distance to its own value
over a dozen Gauss-Newton steps of the few unknowns that move a chain as a whole; many falls at once
are one array. They begin where most edges agree, on a grid of what is not known, the likeliest
first.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np

from rig.analysis.components import above
from rig.analysis.discrepancy import LOWEST_START
from rig.analysis.free_flight import fall_for, fall_through, lasting, leg_slopes, reach_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from rig.analysis.chain_records import ChainRecord, EdgeTrain

    Array = NDArray[np.float64]
    Flags = NDArray[np.bool_]
    Index = NDArray[np.intp]

Item = TypeVar("Item", bound=np.generic)
Span = tuple[float, float]

EVER: Span = (-np.inf, np.inf)
ANY_ALPHA: Span = (-0.10, 0.60)
"""Impact coefficients beyond both ends of what energy allows."""
MISSED = 0.02
"""Share of expected edges that leave no trace, as far as one can know beforehand."""
STRAYS = 2.0
"""Edges of a gate that belong to no rod, 1/s."""
SLOWEST = 0.05
"""m/s: no edge is stamped by a chain slower than this, as far as the density of its time goes."""
RELEASE, START, CLOCK, PULL, DRAG, ALPHA, GROWTH = range(7)
"""Unknowns of a fall: when it begins, how high, the clock's rate, g, κ, α, and how much more the
last impulses are."""
UNKNOWNS = 7
_PART = 6.0  # of the least distance of two rods: σ of the first step, in which no rod is hidden
_WIDEST = 8e-3  # and σ at most, m
_OWN = 8.0  # and what part of that distance σ is at most in the end
_WIDER = 2.0  # by which σ is wider than stated: what is common to a beam or a rod is in it
_STEPS = 12
_COOLING = 0.5  # of σ, from step to step
_DONE = 1.0  # of a standard uncertainty: a step so short is the last
_FAR = 2.5  # prior standard uncertainties within which falls begin
_FAINTEST = 1e-5  # κ, 1/m: of a fall of a metre 3 µm
_SMALL = 1e-4  # of a prior standard uncertainty: steps of differences
_LONGEST = 5e-3  # half width of a vote, s: at the very start a chain is too slow to tell more
_SHORTEST = 0.05e-3
_RECORD = 4.0  # s: what longer a record is, is only searched where most of its edges are
_NODES = 400  # of the grid
_BATCH = 8  # of which are asked together at first
_PEAKS = 5  # starts of a batch that are annealed
_MUCH = 0.7  # of what the best of several falls explains, below which no other is one
_INSTANTS = 12  # at which two falls are compared
_LONGER = 1.2  # widths of a rod: beams see none so wide, see `rig.analysis.later_passages`


@dataclass(frozen=True, slots=True)
class Guess:
    """A fall as the edges might have it.

    Attributes
    ----------
    release
        s since the release fired.
    start
        Height of the reference point before release, m.
    alpha
        Of all impacts; 0 for a free chain.
    kappa
        Of the air, 1/m.
    clock
        By what share the edges' clock is slow.
    pull
        By how much the fall is quicker than with the stated gravity, m/s².
    """

    release: float
    start: float
    alpha: float = 0.0
    kappa: float = 0.0
    clock: float = 0.0
    pull: float = 0.0


def _solved(matrix: Array, right: Array) -> Array:
    """Solve one system of equations for each fall."""
    return np.asarray(np.linalg.solve(matrix, right[..., None])[..., 0], dtype=np.float64)


def _densest(releases: Array) -> Span:
    """Return the first and the last of the fullest seconds of a record that may last hours."""
    if float(np.ptp(releases)) <= _RECORD:
        return float(releases.min()), float(releases.max())
    some = np.sort(releases)
    held = np.searchsorted(some, some + _RECORD, side="right") - np.arange(some.size)
    begin = int(np.argmax(held))
    return float(some[begin]), float(some[begin + held[begin] - 1])


def split(line: NDArray[Item], ends: Index) -> list[NDArray[Item]]:
    """Cut a line of all trains' values at the end of each; much quicker than numpy does."""
    stops = ends.tolist()
    return [line[begin:end] for begin, end in zip([0, *stops], stops, strict=False)]


class Weights(NamedTuple):
    """Which sides of rods compete for each edge, two a edge; shape ``(falls, edges, 2)``.

    Attributes
    ----------
    side
        Number of the expected edge.
    off
        By what height the edge misses it, m.
    sigma
        Standard deviation of that, m.
    weight
        How probably the edge is it; 0 where there is none.
    """

    side: Index
    off: Array
    sigma: Array
    weight: Array


@dataclass(frozen=True, slots=True)
class Pairing:
    """The edges of one side, ready to be matched again and again.

    Attributes
    ----------
    times, number
        Of every observed edge, gate by gate, and its number in its train.
    kind
        Of each: twice the number of its train, and one more where it darkens the beam.
    other
        Of each: the edge at the other end of its shadow, −1 where there is none.
    kinds, rods
        Of every expected edge.
    widths
        Of their rods, m.
    ends
        Number of expected edges after each train.
    """

    times: Array
    number: Index
    kind: Index
    other: Index
    kinds: Index
    rods: Index
    widths: Array
    ends: Index

    @classmethod
    def of(cls, trains: Sequence[EdgeTrain], widths: Sequence[float] = ()) -> Pairing:
        """Take the edges of a side's trains.

        Parameters
        ----------
        widths
            Of the chain's rods, m; without them, shadows may be of any length.
        """
        none = np.zeros(0, dtype=np.intp)
        blocks = np.concatenate([none, *(train.blocks for train in trains)])
        blocked = np.concatenate([none, *(train.blocked for train in trains)])
        numbers = np.concatenate([none, *(np.arange(train.times.size) for train in trains)])
        rods = np.concatenate([none, *(train.rods for train in trains)])
        each = range(len(trains))
        gate = np.repeat(each, [train.times.size for train in trains]).astype(np.intp)
        gates = np.repeat(each, [train.rods.size for train in trains]).astype(np.intp)
        other = np.full(numbers.size, -1)
        begins = np.flatnonzero((gate[1:] == gate[:-1]) & (blocked[:-1] > blocked[1:]))
        other[begins], other[begins + 1] = begins + 1, begins
        return cls(
            np.concatenate([np.zeros(0), *(train.times for train in trains)]),
            numbers,
            2 * gate + blocked,
            other,
            2 * gates + blocks,
            rods,
            np.array(widths)[rods] if widths else np.full(rods.size, np.inf),
            np.cumsum([train.rods.size for train in trains], dtype=np.intp),
        )

    def weights(self, levels: Array, heights: Array, speeds: Array, sigma: Array) -> Weights:
        """Let the two nearest sides of rods, above and below, compete for each edge.

        Parameters
        ----------
        levels, sigma
            The height of the reference point at every expected edge, m, and its standard deviation;
            shape ``(expected,)``.
        heights, speeds
            Where chains are when each edge comes, and how fast; shape ``(falls, edges)``.
        """
        low, high = levels.min(initial=np.inf), levels.max(initial=-np.inf)
        room = high - low + 1.0  # m: kinds in one line, further apart than any two edges of a kind
        line = self.kinds * (3.0 * room) + levels
        order = np.argsort(line)
        heights = np.clip(heights, low - 0.5 * room, high + 0.5 * room)
        mine = self.kind * (3.0 * room) + heights
        after = np.searchsorted(line[order], mine)
        place = np.stack([after - 1, after], axis=-1)
        side = order[np.clip(place, 0, line.size - 1)]
        off = heights[..., None] - levels[side]
        alike = (self.kinds[side] == self.kind[:, None]) & (place >= 0) & (place < line.size)
        width = sigma[side]
        far = np.where(alike, off / width, 40.0)
        density = np.exp(-0.5 * far * far) * ((1.0 - MISSED) / (math.sqrt(2.0 * math.pi) * width))
        clutter = STRAYS / np.maximum(speeds, SLOWEST)
        return Weights(side, off, width, density / (clutter + density.sum(axis=-1))[..., None])

    def chosen(self, weights: Weights, speeds: Array) -> Index:
        """Match one to one: each edge and each side of a rod that want each other most, above ½.

        Parameters
        ----------
        weights, speeds
            Of one fall.

        Returns
        -------
        ndarray
            The edge of every expected one, −1 for a missed one; shape ``(expected,)``.
        """
        best = weights.weight.argmax(axis=1)[:, None]
        taken = {
            name: np.take_along_axis(getattr(weights, name), best, axis=1)[:, 0]
            for name in Weights._fields
        }
        edges = np.flatnonzero(taken["weight"] > 0.5)
        # In units of σ: of several edges the nearest; written last, it stays.
        far = np.abs(taken["off"][edges]) / taken["sigma"][edges]
        edges = edges[np.argsort(-far, kind="stable")]
        found = np.full(self.kinds.size, -1)
        found[taken["side"][edges]] = edges
        return self._whole(found, speeds)

    def _whole(self, found: Index, speeds: Array) -> Index:
        """Give back the top rod's ends of shadows longer than it that no rod below begins or ends.

        A rod that is thrown back and the top rod can make one shadow, and no rod that follows tells
        whose end it is.
        """
        last = self.rods.max(initial=0)
        below = np.zeros(self.times.size + 1, dtype=np.bool_)
        below[found[(found >= 0) & (self.rods < last)]] = True
        sides = np.flatnonzero((found >= 0) & (self.rods == last))
        edges = found[sides]
        sides, edges = sides[self.other[edges] >= 0], edges[self.other[edges] >= 0]
        other = self.other[edges]
        # At uniform acceleration the mean of both speeds is that of the way between.
        length = np.abs(self.times[edges] - self.times[other]) * (speeds[edges] + speeds[other])
        found[sides[(0.5 * length > _LONGER * self.widths[sides]) & ~below[other]]] = -1
        return found

    def matched(self, levels: Array, heights: Array, speeds: Array, scale: float) -> list[Index]:
        """Match the edges to rods.

        Parameters
        ----------
        levels
            The height of the reference point at every expected edge of all trains, m.
        heights, speeds
            Where the chain is believed to be when each edge comes, and how fast.
        scale
            Standard deviation of the distance between where a chain is when an edge comes and where
            it should be, m.

        Returns
        -------
        list of ndarray
            For each train the index of its edge for every expected edge, −1 for a missed one; shape
            ``(expected,)``.
        """
        sigma = np.full(levels.size, scale)
        if not levels.size or not self.times.size:
            return split(np.full(levels.size, -1), self.ends)
        weights = self.weights(levels, heights, speeds, sigma)
        return self.numbered(self.chosen(weights, speeds))

    def numbered(self, found: Index) -> list[Index]:
        """Number edges in their trains, train by train."""
        return split(np.where(found >= 0, self.number[found], -1), self.ends)


class Legs(NamedTuple):
    """Falls from a release at zero, shape ``(falls, legs)`` each, and what they fall by.

    Attributes
    ----------
    gravity, kappa
        m/s², 1/m; shape ``(falls,)``.
    """

    time: Array
    height: Array
    speed: Array
    gravity: Array
    kappa: Array


class Flights(NamedTuple):
    """Where falls are on their legs, shape ``(falls, times)``; the last two may be ``(falls, 1)``.

    Attributes
    ----------
    leg, height
        Which, and where it begins, m.
    lasted, speed
        For how long each is on it, s, and how fast it began there, m/s.
    """

    leg: Index
    height: Array
    lasted: Array
    speed: Array
    gravity: Array
    kappa: Array


class Annealed(NamedTuple):
    """A fall whose edges found their rods.

    Attributes
    ----------
    unknowns
        As deviations from what is stated, shape ``(UNKNOWNS,)``.
    edges
        Of every expected edge, −1 for a missed one.
    evidence
        Logarithm of its marginal likelihood, relative to that all edges are strays.
    scatter
        Root of the mean square of what the edges are off, in σ.
    """

    unknowns: Array
    edges: Index
    evidence: float
    scatter: float

    @property
    def matched(self) -> int:
        """Number of edges that belong to a rod."""
        return int(np.count_nonzero(self.edges >= 0))


class Ballot(NamedTuple):
    """How many edges vote for each release of some falls.

    Attributes
    ----------
    table
        Votes, shape ``(falls, releases)``.
    first, step
        Where the releases begin, and how far apart they are, s.
    fastest
        Of all passages, m/s.
    """

    table: Index
    first: float
    step: float
    fastest: float


@dataclass(frozen=True)
class SideFall:
    """One chain's falls as its edges may tell them, by few unknowns.

    Attributes
    ----------
    record, pairing
        The chain, and the edges of its trains.
    start, gravity, kappa
        As stated, m, m/s², 1/m.
    sd
        Prior standard uncertainty of each unknown, shape ``(UNKNOWNS,)``; 0 for what is known.
    sigma
        By how much every expected edge may be off by itself, m.
    """

    record: ChainRecord
    pairing: Pairing
    start: float
    gravity: float
    kappa: float
    sd: Array
    sigma: Array

    @cached_property
    def levels(self) -> Array:
        """Of every expected edge, m."""
        return np.concatenate([train.levels for train in self.record.trains])

    @cached_property
    def pitch(self) -> float:
        """The least distance of two rods, m."""
        places = np.array(self.record.chain.chain.heights)
        return float(np.diff(places).min()) if places.size > 1 else np.inf

    @property
    def slack(self) -> float:
        """How far off a rod may be in the first step, m."""
        return min(self.pitch / _PART, _WIDEST)

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Within which unknowns stay: air holds back, and something falls."""
        low, high = np.full(UNKNOWNS, -np.inf), np.full(UNKNOWNS, np.inf)
        low[START] = LOWEST_START - self.start
        low[PULL] = -0.9 * self.gravity
        # Of all falls or of none there is air: formulas for both are not the same.
        if self.kappa or self.sd[DRAG]:
            low[DRAG] = _FAINTEST - self.kappa
        low[ALPHA] = min(ANY_ALPHA[0] - self.record.alpha, 0.0)
        high[ALPHA] = max(ANY_ALPHA[1] - self.record.alpha, 0.0)
        return low, high

    def guess(self, unknowns: Array) -> Guess:
        """Say a fall by what it is instead of what it is off."""
        alpha = self.record.alpha + float(unknowns[ALPHA])
        return Guess(
            float(unknowns[RELEASE] * (1.0 + unknowns[CLOCK])),
            self.start + float(unknowns[START]),
            alpha if self.record.ratios is not None else 0.0,
            self.kappa + float(unknowns[DRAG]),
            float(unknowns[CLOCK]),
            float(unknowns[PULL]),
        )

    def legs(self, unknowns: Array) -> Legs:
        """Let the chain fall, shape of `unknowns` ``(falls, UNKNOWNS)``."""
        start, gravity = self.start + unknowns[:, START], self.gravity + unknowns[:, PULL]
        kappa = self.kappa + unknowns[:, DRAG]
        count = len(unknowns)
        if self.record.ratios is None:
            return Legs(np.zeros((count, 1)), start[:, None], np.zeros((count, 1)), gravity, kappa)
        ratios, rods = self.record.ratios, self.record.ratios.size
        height = np.empty((rods + 1, count))
        height[0], height[1:] = start, -self.record.strikes[:, None]
        air = np.broadcast_to(self.record.air, rods + 1)[:rods, None] * kappa
        reach = reach_of(height[:-1] - height[1:], air)
        left, gained = 1.0 - air * reach, gravity * reach
        gains = self.record.alpha + unknowns[:, ALPHA]
        gains = gains + above(rods)[:, None] ** -2.0 * unknowns[:, GROWTH]
        factors = np.maximum(1.0 + gains * ratios[:, None], 1e-3) ** 2
        # Squared speeds before each impact: q f² times the last one, and what was gained since.
        kept = np.cumprod(np.concatenate([np.ones((1, count)), (left[1:] * factors[:-1])]), axis=0)
        before = np.maximum(kept * np.cumsum(gained / kept, axis=0), 0.0)
        after = np.concatenate([np.zeros((1, count)), before * factors])
        time, speed = np.zeros((rods + 1, count)), np.sqrt(after)
        lasted = lasting(reach, speed[:-1], np.sqrt(before), gravity, air)
        np.cumsum(lasted, axis=0, out=time[1:])
        return Legs(time.T, height.T, speed.T, gravity, kappa)

    def passages(self, unknowns: Array) -> tuple[Array, Array]:
        """When falls released at zero pass each expected edge, and how fast; NaN above the start.

        Returns
        -------
        ndarray, ndarray
            Shape ``(falls, expected)``.
        """
        legs = self.legs(unknowns)
        levels = self.levels
        # All falls strike at the same levels: only where they start differs.
        leg = np.searchsorted(-legs.height[0, 1:], -levels, side="right")
        distance = np.maximum(legs.height[:, leg] - levels, 0.0)
        share = np.broadcast_to(self.record.air, legs.height.shape[1])[leg]
        kappa = legs.kappa[:, None] * share
        arrival, lasted = fall_through(distance, legs.speed[:, leg], legs.gravity[:, None], kappa)
        times = legs.time[:, leg] + lasted
        times[levels >= legs.height[:, :1]] = np.nan
        return times, arrival

    def _flights(self, legs: Legs, unknowns: Array, times: Array) -> Flights:
        """On which leg each fall is at each time, and how it fares there."""
        count, size = legs.time.shape
        # The clock's rate counts from the release: hours after the fire it is not told from it.
        since = (times - unknowns[:, RELEASE, None]) * (1.0 + unknowns[:, CLOCK, None])
        leg = np.zeros(since.shape, dtype=np.intp)
        if size > 1:
            # One row after the other in one line.
            last, row = float(legs.time[:, -1].max()), np.arange(count)[:, None]
            line, sought = legs.time + (last + 1.0) * row, np.clip(since, 0.0, last + 0.5)
            leg += np.searchsorted(line.ravel(), sought + (last + 1.0) * row, side="right")
            leg = np.clip(leg - 1 - size * row, 0, size - 1)
        begin, height, speed = (np.take_along_axis(part, leg, axis=1) for part in legs[:3])
        share = np.broadcast_to(self.record.air, size)[leg]
        lasted = np.maximum(since - begin, 0.0)
        return Flights(
            leg, height, lasted, speed, legs.gravity[:, None], legs.kappa[:, None] * share
        )

    def heights(self, unknowns: Array, times: Array) -> tuple[Array, Array]:
        """Where falls are at some times by the edges' clock, and how fast.

        Parameters
        ----------
        times
            Shape ``(times,)``.

        Returns
        -------
        ndarray, ndarray
            m, m/s; shape ``(falls, times)``.
        """
        _, height, *flight = self._flights(self.legs(unknowns), unknowns, times)
        fallen, speed = fall_for(*flight)
        return height - fallen, speed

    def sights(self, unknowns: Array, times: Array) -> tuple[Array, Array, Array]:
        """What `heights` says, and the derivatives by all unknowns; ``(falls, times, UNKNOWNS)``.

        Those of when a leg begins and how fast are differences; on a leg they are exact.
        """
        struck = self.record.ratios is not None
        moved = [n for n in (START, PULL, DRAG, ALPHA, GROWTH) if struck and self.sd[n] > 0.0]
        steps = _SMALL * self.sd * np.eye(UNKNOWNS)[[RELEASE, *moved]]
        steps[0] = 0.0
        legs = self.legs((unknowns + steps[:, None]).reshape(-1, UNKNOWNS))
        every = [part.reshape(len(steps), len(unknowns), *part.shape[1:]) for part in legs]
        leg, height, *flight = self._flights(Legs(*(part[0] for part in every)), unknowns, times)
        fallen, falling, by_speed, by_gravity, by_kappa = leg_slopes(*flight)
        slopes = np.zeros((*leg.shape, UNKNOWNS))
        slopes[..., RELEASE] = falling * (1.0 + unknowns[:, CLOCK, None])
        slopes[..., CLOCK] = -falling * (times - unknowns[:, RELEASE, None])
        slopes[..., START] = leg == 0
        slopes[..., PULL] = -by_gravity
        slopes[..., DRAG] = -by_kappa * np.broadcast_to(self.record.air, legs.time.shape[1])[leg]
        for n, name in enumerate(moved, 1):
            later, faster = ((every[of][n] - every[of][0]) / steps[n, name] for of in (0, 2))
            slopes[..., name] += falling * np.take_along_axis(later, leg, axis=1)
            slopes[..., name] -= by_speed * np.take_along_axis(faster, leg, axis=1)
        return height - fallen, falling, slopes

    def anneal(self, starts: Array) -> list[Annealed]:
        """Let falls find their edges, σ from wide to narrow; shape ``(falls, UNKNOWNS)``."""
        own = np.minimum(_WIDER * self.sigma, self.pitch / _OWN)
        times, sd = self.pairing.times, self.sd.copy()
        sd[RELEASE] = 1.0
        unit = np.where(sd > 0.0, sd, 1.0)
        prior = np.eye(UNKNOWNS)
        prior[RELEASE, RELEASE] = 1e-9
        low, high = self.bounds
        x = np.clip(starts, low, high)
        matrix = np.broadcast_to(prior, (len(x), UNKNOWNS, UNKNOWNS))
        for step in range(_STEPS):
            width = np.maximum(own, self.slack * _COOLING**step)
            height, speed, slopes = self.sights(x, times)
            weights = self.pairing.weights(self.levels, height, speed, width)
            part = weights.weight / weights.sigma**2
            slopes *= sd
            across = np.swapaxes(slopes, 1, 2)
            matrix = (across * part.sum(axis=2)[:, None, :]) @ slopes + prior
            right = (across @ (part * weights.off).sum(axis=2)[..., None])[..., 0]
            right += (x / unit) @ prior
            change = self._bounded(matrix, right, (x - high) / unit, (x - low) / unit)
            # No chain moves on by more than its rods are sought within.
            taken = weights.weight.sum(axis=2)
            moved = np.abs((slopes @ change[..., None])[..., 0]) * (taken > 0.5)
            change *= np.minimum(1.0, width.max() / np.maximum(moved.max(axis=1), 1e-9))[:, None]
            x = np.clip(x - sd * change, low, high)
            explained = taken.sum(axis=1)
            kept = np.flatnonzero(explained >= _MUCH * explained.max())
            x, matrix, change = x[kept], matrix[kept], change[kept]
            if (width > own).any():
                continue
            best = int(np.argmax(explained[kept]))
            if change[best] @ matrix[best] @ change[best] < _DONE**2:
                break
            # Starts that have become the same fall go on as one.
            if len(x) > 1:
                alike = self.unlike(x, np.zeros((0, UNKNOWNS)), len(x), 0.1 * self.slack)
                x, matrix = x[alike], matrix[alike]
        height, speed = self.heights(x, times)
        weights = self.pairing.weights(self.levels, height, speed, own)
        y = x / unit
        lost = 0.5 * ((y @ prior) * y).sum(axis=1) + 0.5 * np.linalg.slogdet(matrix)[1]
        return [
            self._judged(
                x[n], Weights(*(part[n] for part in weights)), height[n], speed[n], own, loss
            )
            for n, loss in enumerate(lost.tolist())
        ]

    @staticmethod
    def _bounded(matrix: Array, right: Array, least: Array, most: Array) -> Array:
        """Solve for steps; what would leave its bounds goes there, and the others follow."""
        change = _solved(matrix, right)
        held = (change < least) | (change > most)
        if not held.any():
            return change
        known = np.where(held, np.clip(change, least, most), 0.0)
        right = np.where(held, known, right - (matrix @ known[..., None])[..., 0])
        free = ~held[:, :, None] & ~held[:, None, :]
        matrix = np.where(free, matrix, np.eye(UNKNOWNS))
        return _solved(matrix, right)

    def _judged(
        self, x: Array, weights: Weights, height: Array, speed: Array, sigma: Array, loss: float
    ) -> Annealed:
        """Match one fall's edges one to one, and weigh what that explains."""
        edges = self.pairing.chosen(weights, speed)
        sides = np.flatnonzero(edges >= 0)
        mine = edges[sides]
        far = (height[mine] - self.levels[sides]) / sigma[sides]
        density = np.log(
            np.maximum(speed[mine], SLOWEST) / (sigma[sides] * math.sqrt(2.0 * math.pi))
        )
        worth = math.log((1.0 - MISSED) / MISSED) - math.log(STRAYS)
        evidence = float(np.sum(density - 0.5 * far**2 + worth)) - loss
        scatter = math.sqrt(float(far @ far) / max(1, far.size))
        return Annealed(x, edges, evidence if math.isfinite(evidence) else -math.inf, scatter)

    def nodes(self) -> Array:
        """Falls to begin with, the likeliest first; shape ``(nodes, UNKNOWNS)``.

        Along each unknown they are so near that none between them is missed: with the release
        free, none is off by more than the first step allows.
        """
        low, high = self.bounds
        stated = np.clip(np.zeros((1, UNKNOWNS)), low, high)
        times = self.passages(stated)[0][0]
        times = times[np.isfinite(times)]
        grid = np.zeros((1, UNKNOWNS))
        if times.size:
            slopes = self.sights(stated, times)[2][0]
            begin = slopes[:, RELEASE]
            slopes = slopes - np.outer(begin, begin @ slopes) / max(float(begin @ begin), 1e-12)
            effects = (np.abs(slopes).max(axis=0) * self.sd / (2.0 * self.slack)).tolist()
            for name in (START, CLOCK, PULL, DRAG, ALPHA):
                steps = int(_FAR * effects[name] + 0.5)
                axis = np.arange(-steps, steps + 1) / max(effects[name], steps / _FAR, 1e-9)
                grid = np.repeat(grid, axis.size, axis=0)
                grid[:, name] = np.tile(axis, len(grid) // axis.size)
                # What is unlikely for one unknown will not be likelier with another.
                unlikely = (grid * grid).sum(axis=1)
                order = np.argsort(unlikely, kind="stable")[:_NODES]
                grid = grid[order[unlikely[order] <= _FAR**2 + _SMALL]]
        x = stated + self.sd * grid
        return np.asarray(x[((x >= low) & (x <= high)).all(axis=1)])

    def starts(self, window: Span = EVER, least: float = 0.0) -> Iterator[tuple[Array, Array]]:
        """Yield falls where most edges agree, batch by batch of the grid.

        Parameters
        ----------
        window
            Within which chains were let go, s.
        least
            Votes without which nothing begins.

        Yields
        ------
        ndarray, ndarray
            Falls, shape ``(falls, UNKNOWNS)``, and how many edges vote for each.
        """
        nodes, begin, size = self.nodes(), 0, _BATCH
        while begin < len(nodes):
            some = nodes[begin : begin + size]
            ballot = self._ballot(some, window)
            yield (
                (np.zeros((0, UNKNOWNS)), np.zeros(0))
                if ballot is None
                else self._peaks(some, ballot, least)
            )
            begin, size = begin + size, 2 * size

    def most_votes(self) -> int:
        """Count the edges that agree on one of the likeliest falls of the grid, at most."""
        ballot = self._ballot(self.nodes()[:_BATCH], EVER)
        return 0 if ballot is None else int(ballot.table.max())

    def _ballot(self, nodes: Array, window: Span) -> Ballot | None:
        """Let every edge vote, for each node, for the releases from which it would be a rod's."""
        due, speeds = self.passages(nodes)
        edge, side = np.nonzero(self.pairing.kind[:, None] == self.pairing.kinds)
        # What no fall passes votes for no moment, and what is outside the window either.
        due = np.where(np.isnan(due), np.inf, due)
        near = self.pairing.times[edge] - due.min(axis=0)[side] >= window[0] - 2.0 * _LONGEST
        edge, side = edge[near], side[near]
        release = self.pairing.times[edge] - due[:, side] / (1.0 + nodes[:, CLOCK, None])
        there = (release >= max(window[0], -1e9) - _LONGEST) & (release <= window[1] + _LONGEST)
        if not there.any():
            return None
        first, last = _densest(release[there])
        there &= (release >= first) & (release <= last)
        half = np.clip(self.slack / np.maximum(speeds, 1e-9), _SHORTEST, _LONGEST)
        step = float(half.min()) / 2.0
        first -= _LONGEST
        bins = int((last + _LONGEST - first) / step) + 2
        place, reach = (release[there] - first) / step, half[:, side][there] / step
        row = (bins + 1) * np.nonzero(there)[0]
        votes = np.zeros(len(nodes) * (bins + 1), dtype=np.intp)
        for sign in (-1, 1):
            bound = np.clip(np.rint(place + sign * reach), 0, bins).astype(np.intp)
            votes -= sign * np.bincount(row + bound, minlength=votes.size)
        table = np.cumsum(votes.reshape(len(nodes), bins + 1), axis=1)
        return Ballot(table, first, step, float(speeds.max()))

    def _peaks(self, nodes: Array, ballot: Ballot, least: float) -> tuple[Array, Array]:
        """Take the highest counts of which no two are the same fall."""
        table, step = ballot.table, ballot.step
        found, votes = [], []
        row = np.arange(len(nodes))
        width = max(1, int(0.5 * _PART * self.slack / ballot.fastest / step))
        width = min(width, max(1, int(_LONGEST / step)))
        near = np.arange(-width, width + 1)
        for _ in range(_PEAKS):
            at = table.argmax(axis=1)
            count = table[row, at]
            # The middle of a plateau, not its beginning.
            end = np.array(
                [np.argmin(line[n:] == c) for line, n, c in zip(table, at, count, strict=True)]
            )
            middle = at + np.maximum(end - 1, 0) // 2
            starts = nodes.copy()
            starts[:, RELEASE] = ballot.first + step * (middle + 0.5)
            found.append(starts)
            votes.append(count)
            table[row[:, None], np.clip(middle[:, None] + near, 0, table.shape[1] - 1)] = 0
        every, count = np.concatenate(found), np.concatenate(votes)
        enough = (count > 0) & (count >= least) & (count >= _MUCH * count.max())
        every, count = every[enough], count[enough]
        order = np.argsort(-count, kind="stable")
        every, count = every[order], count[order]
        chosen = self.unlike(every, np.zeros((0, UNKNOWNS)), _PEAKS)
        return every[chosen], count[chosen]

    def unlike(
        self, falls: Array, known: Array, most: int, apart: float | None = None
    ) -> list[int]:
        """Return the first falls of which each differs from all before and from those known."""
        if not len(falls):
            return []
        apart = self.slack if apart is None else apart
        begin, end = float(self.pairing.times.min()), float(self.pairing.times.max())
        begin = max(begin, min(float(falls[:, RELEASE].min()), end))
        times = np.linspace(begin, end, _INSTANTS)
        heights = self.heights(np.concatenate([known, falls]), times)[0]
        # Below the ground nothing tells them apart.
        heights = np.maximum(
            heights, float(self.levels.min()) - self.pitch if self.pitch < np.inf else -np.inf
        )
        kept = [*range(len(known))]
        for n in range(len(known), len(heights)):
            if len(kept) - len(known) >= most:
                break
            if not kept or np.abs(heights[kept] - heights[n]).max(axis=1).min() > apart:
                kept.append(n)
        return [n - len(known) for n in kept[len(known) :]]
