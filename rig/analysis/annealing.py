"""Which edge is which rod: one likelihood of a side's edges, annealed from wide to narrow.

An edge at a gate is a rod's side of its polarity or clutter, and all sides compete for it: with the
height h by which an edge misses a side, it belongs to that side with the weight
(1 − m) N(h; 0, σ) / (λ/v + (1 − m) Σ N). σ halves from a part of the rods' distance to its own
value over a few Gauss-Newton steps of the unknowns that move a chain as a whole; many falls at once
are one array. They begin where most edges agree, on a grid of what is not known, the likeliest
first.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np

from rig.analysis.air import prior_air
from rig.analysis.chain_records import WIDER
from rig.analysis.components import above
from rig.analysis.discrepancy import LOWEST_START
from rig.analysis.free_flight import FAINT
from rig.analysis.trajectory import COMMON, GRAVITY, ONE, free_trajectory, struck_trajectory
from rig.analysis.unknowns import ANY_GRAVITY

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from rig.analysis.chain_records import ChainRecord, EdgeTrain
    from rig.analysis.components import Components
    from rig.analysis.trajectory import Trajectory
    from rig.arrays import Array, Index
    from rig.protocol.protocol import Protocol


Item = TypeVar("Item", bound=np.generic)

MISSED = 0.02
"""Share of expected edges that leave no trace, as far as one can know beforehand."""
STRAYS = 2.0
"""Edges of a gate that belong to no rod, 1/s."""
ANY_ALPHA = (-0.10, 0.60)
"""Impact coefficients beyond both ends of what energy allows (½ and 0)."""
RELEASE, START, CLOCK, PULL, DRAG, ALPHA, GROWTH, UNKNOWNS = range(8)
"""Unknowns of a fall: when it begins, how high, the clock's rate, g, κ, α, and how much more the
last impulses are; and how many these are."""
PART = 6.0
"""Of the least distance of two rods: σ of the first step, in which no rod is hidden."""
_BROADER = 2.0
"""By which σ of the last step is larger than stated: what is common to a beam or rod is in it."""
_STEPS = 12
_FAR = 2.5
"""Prior standard uncertainties within which falls begin: 99 of 100 of what is as stated."""
_RECORD = 4.0
"""What longer a record is, is only searched where most of its edges are, s: no fall is longer."""
_NODES = 400
_BATCH = 8  # of which are asked together at first
PEAKS = 5
"""Starts of a batch that are annealed."""
_ALIKE = 0.75
"""Share of the edges that two starts give to the same rods, above which they end as one fall."""
LEAST = 0.6
"""Share of the expected edges, or of what the best of several falls explains, below which no fall
is one."""


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

    @classmethod
    def stated(cls, protocol: Protocol, record: ChainRecord) -> Guess:
        """Let a chain begin as stated."""
        kappa, _ = prior_air(protocol)
        return cls(0.0, protocol.drop.value, record.alpha, kappa)


def split(line: NDArray[Item], ends: Index) -> list[NDArray[Item]]:
    """Cut a line of all trains' values at the end of each; much quicker than numpy does."""
    stops = ends.tolist()
    return [line[begin:end] for begin, end in zip([0, *stops], stops, strict=False)]


def log_density(off: Array, sigma: Array | float, speed: Array) -> Array:
    """Logarithm of how much likelier an edge's time is as a rod's than as a stray, beforehand.

    Relative to a reading in which all edges are strays and every rod was missed.

    Parameters
    ----------
    off, sigma
        By what height it misses the rod's side, and the standard deviation of that, m.
    speed
        Of the rod, m/s.
    """
    worth = math.log((1.0 - MISSED) / MISSED / STRAYS / math.sqrt(2.0 * math.pi))
    tiny = np.finfo(float).tiny
    return np.log(np.maximum(speed, tiny) / sigma) - 0.5 * (off / sigma) ** 2 + worth


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


@dataclass(frozen=True)
class Pairing:
    """The edges of one side, ready to be matched again and again.

    Attributes
    ----------
    times, burst
        Of every observed edge, gate by gate, see `rig.analysis.chain_records.EdgeTrain`.
    kind
        Of each: twice the number of its train, and one more where it darkens the beam.
    other
        Of each: the edge at the other end of its shadow, −1 where there is none.
    kinds, rods
        Of every expected edge.
    widths
        Of their rods, m.
    begins, ends
        Number of observed edges before each train, and of expected ones after each.
    """

    times: Array
    burst: Array
    kind: Index
    other: Index
    kinds: Index
    rods: Index
    widths: Array
    begins: Index
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
        blocked = np.concatenate([none, *(train.blocked for train in trains)])
        rods = np.concatenate([none, *(train.rods for train in trains)])
        kind, kinds = (
            np.concatenate([none, *(2 * n + sides for n, sides in enumerate(states))])
            for states in ([gate.blocked for gate in trains], [gate.blocks for gate in trains])
        )
        partner = np.full(blocked.size, -1)
        begins = np.flatnonzero((kind[1:] == kind[:-1] - 1) & (blocked[:-1] > blocked[1:]))
        partner[begins], partner[begins + 1] = begins + 1, begins
        return cls(
            np.concatenate([np.zeros(0), *(train.times for train in trains)]),
            np.concatenate([np.zeros(0), *(train.burst for train in trains)]),
            kind,
            partner,
            kinds,
            rods,
            np.array(widths)[rods] if widths else np.full(rods.size, np.inf),
            np.cumsum([0, *(train.times.size for train in trains)], dtype=np.intp)[:-1],
            np.cumsum([train.rods.size for train in trains], dtype=np.intp),
        )

    def observed(self, matches: Sequence[Index]) -> tuple[Index, Index]:
        """Expected edges that are matched, and the observed edge of each."""
        match = np.concatenate(matches)
        pick = np.flatnonzero(match >= 0)
        return pick, (match + self._first)[pick]

    @cached_property
    def _first(self) -> Index:
        """Number of the first observed edge in the train of every expected one."""
        return self.begins[self.kinds // 2]

    @cached_property
    def pairs(self) -> tuple[Index, Index]:
        """Every edge with every expected one that it may be by its gate and polarity."""
        edge, side = np.nonzero(self.kind[:, None] == self.kinds)
        return edge, side

    def weights(
        self, levels: Array, heights: Array, speeds: Array, sigma: Array | float
    ) -> Weights:
        """Let the two nearest sides of rods, above and below, compete for each edge.

        Parameters
        ----------
        levels, sigma
            The height of the reference point at every expected edge, m, and its standard deviation;
            shape ``(expected,)``.
        heights, speeds
            Where chains are when each edge comes, and how fast; shape ``(…, edges)``.
        """
        low, high = levels.min(initial=np.inf), levels.max(initial=-np.inf)
        room = high - low + 1.0  # m: kinds in one line, further apart than any two edges of a kind
        line = self.kinds * (3.0 * room) + levels
        order = np.argsort(line)
        heights = np.clip(heights, low - 0.5 * room, high + 0.5 * room)
        after = np.searchsorted(line[order], self.kind * (3.0 * room) + heights)
        side = order[np.clip(np.stack([after - 1, after], axis=-1), 0, line.size - 1)]
        off = heights[..., None] - levels[side]
        width = np.broadcast_to(sigma, levels.shape)[side]
        far = np.where(self.kinds[side] == self.kind[:, None], off / width, 40.0)
        far[..., 1] = np.where(side[..., 0] == side[..., 1], 40.0, far[..., 1])
        # Nothing that hangs still is seen to pass.
        density = speeds[..., None] * np.exp(-0.5 * far * far) / width
        clutter = STRAYS * math.sqrt(2.0 * math.pi) / (1.0 - MISSED)
        return Weights(side, off, width, density / (clutter + density.sum(-1, keepdims=True)))

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
        edges, which = np.nonzero(weights.weight > 0.5)
        # In units of σ: of several edges the nearest; written last, it stays.
        far = np.abs(weights.off[edges, which]) / weights.sigma[edges, which]
        order = np.argsort(-far, kind="stable")
        edge_of = np.full(self.kinds.size, -1)
        edge_of[weights.side[edges, which][order]] = edges[order]
        return self._whole(edge_of, speeds)

    def _whole(self, edge_of: Index, speeds: Array) -> Index:
        """Give back the top rod's ends of shadows longer than it.

        A rod that is thrown back is in them too, and no rod that follows tells whose end it is.
        """
        last = self.rods.max(initial=0)
        sides = np.flatnonzero((edge_of >= 0) & (self.rods == last))
        sides = sides[self.other[edge_of[sides]] >= 0]
        edges = edge_of[sides]
        partner = self.other[edges]
        # At uniform acceleration the mean of both speeds is that of the way between.
        length = np.abs(self.times[edges] - self.times[partner]) * (speeds[edges] + speeds[partner])
        edge_of[sides[0.5 * length > WIDER * self.widths[sides]]] = -1
        return edge_of

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
        if not levels.size or not self.times.size:
            return split(np.full(levels.size, -1), self.ends)
        weights = self.weights(levels, heights, speeds, scale)
        return self.numbered(self.chosen(weights, speeds))

    def numbered(self, edge_of: Index) -> list[Index]:
        """Number edges in their trains, train by train."""
        return split(np.where(edge_of >= 0, edge_of - self._first, -1), self.ends)


class Annealed(NamedTuple):
    """A fall whose edges found their rods.

    Attributes
    ----------
    guess
        The fall.
    edges
        Of every expected edge, −1 for a missed one; a list, for there may be several sides.
    evidence
        Logarithm of its marginal likelihood, relative to that all edges are strays.
    scatter
        Root of the mean square of what the edges are off, in σ.
    """

    guess: Guess
    edges: list[Index]
    evidence: float
    scatter: float

    @property
    def matched(self) -> int:
        """Number of edges that belong to a rod."""
        return int(np.count_nonzero(self.edges[0] >= 0))


@dataclass(frozen=True)
class SideFall:
    """One chain's falls as its edges may tell them, by few unknowns.

    A fall is an array of these in units of their prior uncertainties, as deviations from what is
    stated; many falls have the shape ``(falls, UNKNOWNS)``.

    Attributes
    ----------
    record, pairing
        The chain, and the edges of its trains.
    stated
        Where it begins as stated.
    gravity
        As stated, m/s².
    sd
        Prior standard uncertainty of each unknown, shape ``(UNKNOWNS,)``; 0 for what is known, and
        1 s for the release, of which nothing is.
    sigma
        By how much every expected edge may be off by itself, m; falls are counted without.
    """

    record: ChainRecord
    pairing: Pairing
    stated: Guess
    gravity: float
    sd: Array
    sigma: Array

    @classmethod
    def of(
        cls,
        protocol: Protocol,
        record: ChainRecord,
        pairing: Pairing,
        clock_u: float,
        components: Components,
        sigma: Array = ONE,
    ) -> SideFall:
        """Take a side of a drop that begins as stated."""
        sd = np.zeros(UNKNOWNS)
        sd[RELEASE], sd[START] = 1.0, math.hypot(protocol.drop.u, components.hang)
        sd[CLOCK], (_, sd[DRAG]) = clock_u, prior_air(protocol)
        sd[PULL] = ANY_GRAVITY if protocol.surface is None else protocol.gravity.u
        if record.ratios is not None:
            # All α are alike that energy allows.
            sd[ALPHA] = (ANY_ALPHA[1] - ANY_ALPHA[0]) / math.sqrt(12.0)
            sd[GROWTH] = protocol.priors.strings * abs(record.alpha)
        stated, gravity = Guess.stated(protocol, record), protocol.gravity.value
        return cls(record, pairing, stated, gravity, sd, sigma)

    @cached_property
    def levels(self) -> Array:
        """Of every expected edge, m."""
        return np.concatenate([train.levels for train in self.record.trains])

    @cached_property
    def slack(self) -> float:
        """How far off a rod may be in the first step, m: part of the least distance of two rods.

        A single object's width takes its place.
        """
        places, widths = self.record.chain.chain.heights, self.record.chain.widths
        return float(min(np.diff(places) if len(places) > 1 else widths)) / PART

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Within which unknowns stay: air holds back, and something falls."""
        low, high = np.full(UNKNOWNS, -np.inf), np.full(UNKNOWNS, np.inf)
        low[START] = LOWEST_START - self.stated.start
        low[PULL] = -0.9 * self.gravity
        low[DRAG] = FAINT - self.stated.kappa  # formulas for air and for none are not the same
        low[ALPHA], high[ALPHA] = ANY_ALPHA - np.clip(self.stated.alpha, *ANY_ALPHA)
        exact = self.sd == 0.0
        unit = np.where(exact, 1.0, self.sd)
        return np.where(exact, -np.inf, low / unit), np.where(exact, np.inf, high / unit)

    @cached_property
    def _by(self) -> Array:
        """Derivatives of a trajectory's parameters by the unknowns, but for times."""
        rods = 0 if self.record.ratios is None else self.record.ratios.size
        by = np.zeros((COMMON + 2 * rods, UNKNOWNS))
        by[[1, GRAVITY, 3], [START, PULL, DRAG]] = 1.0
        by[COMMON : COMMON + rods, ALPHA] = 1.0
        by[COMMON : COMMON + rods, GROWTH] = above(self.record.chain.chain)[:rods] ** -2.0
        return by * self.sd

    def path(self, falls: Array) -> Trajectory:
        """Let the chain fall from a release at zero."""
        off, record = (falls * self.sd).T[..., None], self.record
        start, gravity = self.stated.start + off[START], self.gravity + off[PULL]
        kappa = self.stated.kappa + off[DRAG]
        if record.ratios is None:
            return free_trajectory(0.0, start, gravity, kappa, record.air)
        gains = record.alpha + off[ALPHA] + off[GROWTH] * above(record.chain.chain) ** -2.0
        strikes = record.strikes
        return struck_trajectory(
            0.0, start, gravity, gains, record.ratios, strikes, kappa, record.air
        )

    def since(self, falls: Array, times: Array) -> Array:
        """How long after the release some times of the edges' clock are, s.

        The clock's rate counts from there: hours after the fire it is not told from it.
        """
        rate: Array = 1.0 + falls[:, CLOCK, None] * self.sd[CLOCK]
        return (times - falls[:, RELEASE, None]) * rate

    def sights(self, falls: Array) -> tuple[Array, Array, Array]:
        """Where falls are as each edge comes, how fast, and the derivatives by all unknowns.

        Returns
        -------
        ndarray, ndarray, ndarray
            m, m/s; shape ``(falls, edges)``, and ``(falls, edges, UNKNOWNS)``.
        """
        since = self.since(falls, self.pairing.times)
        height, speed, slopes = self.path(falls).sights(since, self._by)
        # A clock's rate is 1 to the digits that count here.
        slopes[..., RELEASE], slopes[..., CLOCK] = speed, -speed * since * self.sd[CLOCK]
        return height, speed, slopes

    def anneal(self, falls: Array, close: float = np.inf) -> list[Annealed]:
        """Let falls find their edges, σ from wide to narrow.

        Parameters
        ----------
        falls
            Where they start.
        close
            Log odds behind the best one beyond which a fall is given up.
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
            change = _bounded(matrix, gradient, y - high, y - low)
            lasting, done = np.ones(len(y), dtype=np.bool_), False
            if (width <= own).all():  # before that a fall may be on its way
                likely = -np.log1p(-np.minimum(taken, 1.0 - 1e-12)).sum(axis=1)
                lasting = likely >= likely.max() - close
                size = (change[:, None] @ matrix @ change[..., None])[:, 0, 0]
                done = bool((size[lasting] < 1.0).all())
            if done or step == _STEPS - 1:
                break
            # No chain moves on by more than its rods are sought within.
            moved = (slopes @ change[..., None])[..., 0] * (taken > 0.5)
            longest = np.abs(moved).max(axis=1, initial=1e-9)
            change *= np.minimum(1.0, width.max() / longest)[:, None]
            y = np.clip(y - change, low, high)[lasting]
        lost = 0.5 * ((y @ prior) * y).sum(axis=1) + 0.5 * np.linalg.slogdet(matrix)[1]
        return [
            self._judged(
                y[n], Weights(*(part[n] for part in weights)), height[n], speed[n], lost[n]
            )
            for n in np.flatnonzero(lasting)
        ]

    def _judged(
        self, fall: Array, weights: Weights, height: Array, speed: Array, lost: float
    ) -> Annealed:
        """Match one fall's edges one to one, and weigh what that explains."""
        edges = self.pairing.chosen(weights, speed)
        sides = np.flatnonzero(edges >= 0)
        sigma = np.minimum(_BROADER * self.sigma, self.slack)[sides]
        off = height[edges[sides]] - self.levels[sides]
        evidence = float(log_density(off, sigma, speed[edges[sides]]).sum() - lost)
        scatter = math.sqrt(float(((off / sigma) ** 2).sum()) / max(1, sides.size))
        x, stated = (fall * self.sd).tolist(), self.stated
        guess = Guess(
            x[RELEASE] * (1.0 + x[CLOCK]),
            stated.start + x[START],
            stated.alpha + x[ALPHA],
            stated.kappa + x[DRAG],
            x[CLOCK],
            x[PULL],
        )
        return Annealed(guess, [edges], evidence if math.isfinite(evidence) else -math.inf, scatter)

    def nodes(self) -> Array:
        """Falls to begin with, the likeliest first.

        Along each unknown they are so near that none between them is missed: with the release
        free, none is off by more than the first step allows.
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
                # What is unlikely for one unknown will not be likelier with another.
                unlikely = (grid * grid).sum(axis=1)
                order = np.argsort(unlikely, kind="stable")[:_NODES]
                grid = grid[order[unlikely[order] <= _FAR**2 + 1e-9]]
        return np.asarray(grid[((grid >= low) & (grid <= high)).all(axis=1)])

    def starts(self, earliest: float, least: float) -> Iterator[Array]:
        """Yield falls where most edges agree, batch by batch of the grid.

        Parameters
        ----------
        earliest
            When chains were let go at the earliest, s.
        least
            Votes without which nothing begins.

        Yields
        ------
        ndarray
            Falls, those first for which most edges vote.
        """
        nodes, size = self.nodes(), _BATCH
        while len(nodes):
            batch, nodes = nodes[:size], nodes[size:]
            size *= 2
            falls, votes = self._voted(batch, earliest)
            enough = (votes > 0) & (votes >= max(least, LEAST * votes.max(initial=0)))
            order = np.flatnonzero(enough)[np.argsort(-votes[enough], kind="stable")][: 4 * PEAKS]
            yield falls[order[self._unlike(falls[order])] if order.size else order]

    def most_votes(self) -> int:
        """Count the edges that agree on one of the likeliest falls of the grid, at most."""
        return int(self._voted(self.nodes()[:_BATCH])[1].max(initial=0))

    def _voted(self, nodes: Array, earliest: float = -np.inf) -> tuple[Array, Index]:
        """Let every edge vote, for each node, for the releases from which it would be a rod's.

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
        # A record may last hours: a fall is where most of the edges are.
        until = np.searchsorted(times, times + _RECORD, side="right")
        first = int(np.argmax(until - np.arange(times.size)))
        begin = max(float(times[first] - late.max()), earliest)
        end = float(times[until[first] - 1] - early.min())
        if end < begin:
            return nodes[:0], np.zeros(0, dtype=np.intp)
        # At the fastest passages votes are two steps wide.
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
        # A rod's distance at the fastest passage apart, no two are the same.
        row, near = np.arange(len(nodes)), np.arange(-int(PART / 2.0), int(PART / 2.0) + 1)
        falls, counts = np.repeat(nodes[None], PEAKS, axis=0), []
        for peak in falls:
            at = table.argmax(axis=1)
            counts.append(table[row, at])
            # The middle of a plateau, not its beginning.
            ends = [
                np.argmin(line[n:] == line[n]) for line, n in zip(table, at.tolist(), strict=True)
            ]
            middle = at + np.maximum(np.array(ends) - 1, 0) // 2
            peak[:, RELEASE] = begin + step * (middle + 0.5)
            table[row[:, None], np.clip(middle[:, None] + near, 0, bins)] = 0
        return falls.reshape(-1, UNKNOWNS), np.concatenate(counts)

    def _unlike(self, falls: Array) -> list[int]:
        """Return the first falls of which each gives other rods to the edges than all before."""
        chosen: list[int] = []
        height, speed = self.path(falls).heights(self.since(falls, self.pairing.times))
        side, _, _, weight = self.pairing.weights(self.levels, height, speed, self.slack)
        rods = np.where(weight > 0.5, side, -1).max(axis=2)
        for n, sides in enumerate(rods):
            alike = ((rods[chosen] == sides) & (sides >= 0)).sum(axis=1)
            if len(chosen) < PEAKS and (alike <= _ALIKE * (sides >= 0).sum()).all():
                chosen.append(n)
        return chosen


def _bounded(matrix: Array, gradient: Array, low: Array, high: Array) -> Array:
    """Solve for steps; what would leave its bounds goes there, and the others follow."""
    change = np.linalg.solve(matrix, gradient[..., None])[..., 0]
    held = (change < low) | (change > high)
    if held.any():
        fixed = np.where(held, np.clip(change, low, high), 0.0)
        gradient = np.where(held, fixed, gradient - (matrix @ fixed[..., None])[..., 0])
        free = ~held[:, :, None] & ~held[:, None, :]
        matrix = np.where(free, matrix, np.eye(UNKNOWNS))
        change = np.linalg.solve(matrix, gradient[..., None])[..., 0]
    return np.asarray(change)
