"""Assignment of edges to rods: a mixture likelihood of a side's edges, annealed.

An edge at a gate is a rod's side of its polarity, or clutter. With the height h between an edge and
a rod's side, it belongs to that side with the weight (1 − m) N(h; 0, σ) / (λ/v + (1 − m) Σ N).
σ starts at a part of the rods' spacing and halves to its final value over a few Gauss-Newton steps.
These fit the unknowns that move a chain as a whole; many falls are fitted as an array. Starts are
the points of a grid of the unknowns at which most edges agree, the likeliest first.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.analysis.chain_records import MISSED, ChainRecord
from rig.analysis.components import ALPHA_SD, ANY_ALPHA
from rig.analysis.departures import LOWEST_START
from rig.analysis.free_flight import FAINT
from rig.analysis.unknowns import prior_air
from rig.arrays import Array, Index

if TYPE_CHECKING:
    from rig.analysis.drop_model import DropModel
    from rig.analysis.trajectory import Trajectory

STRAYS = 2.0
"""Prior rate of stray edges at a gate, 1/s."""
NAMES = "release", "drop", "clock", "gravity", "drag", "alpha"
"""Names of a fall's unknowns; without strikes it has no α."""
RELEASE, START, CLOCK, PULL, DRAG, ALPHA = range(len(NAMES))
"""Columns of these: release time, start height, clock rate, g, κ, α of all impacts."""
PART = 6.0
"""Least spacing of two rods over σ of the first step: narrow enough to resolve neighbours."""
_BROADER = 2.0
"""Ratio of σ in the last step to its own value: allows for errors common to a beam or rod."""
_STEPS = 12
_FAR = 2.5
"""Radius of the grid of starts in prior standard uncertainties: 99 % of drops as stated."""
_NODES = 400
PEAKS = 5
"""Candidates of a search that are pursued: starts of a batch, readings, faults. Twice as many grid
points are in the first batch."""
LEAST = 0.6
"""Least share of the expected edges that a fall must explain. Also the least share of the best
start's votes with which another start is tried, and the largest share of edges that it may assign
like that."""


def matched(match: Index) -> tuple[Index, Index]:
    """Return the expected edges that are matched, and the observed edge of each."""
    pick = np.flatnonzero(match >= 0)
    return pick, match[pick]


def count_matched(match: Index) -> int:
    """Return the number of matched edges of a side."""
    return int(np.count_nonzero(match >= 0))


def log_density(off: Array, sigma: Array | float, speed: Array, absent: Array) -> Array:
    """Return the log likelihood ratio of each edge as a rod's edge against a stray.

    The reference is a reading in which all edges are strays and every rod was missed.

    Parameters
    ----------
    off, sigma
        Height between edge and rod's side, and its standard deviation, m.
    speed
        Speed of the rod, m/s.
    absent
        Prior probability that the edge does not come.
    """
    worth = np.log((1.0 - absent) / absent / STRAYS / math.sqrt(2.0 * math.pi))
    tiny = np.finfo(float).tiny
    return np.asarray(np.log(np.maximum(speed, tiny) / sigma) - 0.5 * (off / sigma) ** 2 + worth)


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


class Pairing:
    """The observed and expected edges of one side, prepared for repeated matching.

    Attributes
    ----------
    kind, kinds
        Kind of every observed and of every expected edge: twice the number of its gate, plus 1 if
        it darkens the beam.
    lasting
        Duration of the shadow that each observed edge is an end of, s; 0 if it is of none.
    longest
        Length of the longest shadow that every expected edge may be an end of, m.
    """

    def __init__(self, record: ChainRecord) -> None:
        edges, due = record.edges, record.due
        self.kind: Index = 2 * edges.gate + edges.blocked
        self.kinds: Index = 2 * due.gate + due.blocks
        self.lasting: Array = np.zeros(edges.times.size)
        begins = np.flatnonzero(edges.blocked[:-1] & (np.diff(self.kind) == -1))
        self.lasting[begins] = self.lasting[begins + 1] = np.diff(edges.times)[begins]
        is_top = due.rods == due.rods.max(initial=0)
        self.longest: Array = np.where(is_top, record.top_shadow, math.inf)

    @property
    def matchable(self) -> int:
        """Number of edges that are matchable by gate and polarity alone."""
        kinds = 1 + max(self.kind.max(initial=0), self.kinds.max(initial=0))
        counts = [np.bincount(kind, minlength=kinds) for kind in (self.kind, self.kinds)]
        return int(np.minimum(*counts).sum())

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
            The height of the reference point at every expected edge, m.
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
        if not levels.size or not self.kind.size:
            return np.full(levels.size, -1)
        return self.chosen(self.weights(levels, heights, speeds, scale), speeds)


class FallFit(NamedTuple):
    """An annealed fall with its matched edges.

    Attributes
    ----------
    x
        The drop's unknowns by this side alone, shape ``(unknowns,)``.
    matches
        Observed edge of every expected edge by role, −1 if missed.
    evidence
        Logarithm of the marginal likelihood, relative to all edges being strays.
    scatter
        Root mean square of the edges' residuals, in σ.
    """

    x: Array
    matches: dict[str, Index]
    evidence: float
    scatter: float


@dataclass(frozen=True)
class SideFall:
    """A side of a drop with the few unknowns that move its chain as a whole, for annealing.

    A fall is an array of these in units of their prior uncertainties, as deviations from the stated
    values; many falls have the shape ``(falls, columns)``.

    Attributes
    ----------
    model, role
        The drop, and the side.
    """

    model: DropModel
    role: str

    @property
    def record(self) -> ChainRecord:
        """The chain, with its edges."""
        return self.model.records[self.role]

    @property
    def pairing(self) -> Pairing:
        """Its edges, prepared for matching."""
        return self.model.pairings[self.role]

    @cached_property
    def columns(self) -> Index:
        """Places of its unknowns in the drop's vector, as `RELEASE` and the others say."""
        names = [f"{self.role} release", *NAMES[START:]]
        names = names[:ALPHA] if self.record.ratios is None else names
        return np.array([self.model.unknowns[name].start for name in names])

    @cached_property
    def sd(self) -> Array:
        """Prior standard uncertainty of each unknown; 1 s for the release, which has no prior."""
        sd = self.model.unknowns.sd[self.columns]
        sd[START] = math.hypot(sd[START], self.model.components.hang)
        sd[ALPHA:] = ALPHA_SD
        return sd

    @cached_property
    def levels(self) -> Array:
        """Level of every expected edge, m."""
        return self.model.expected[self.role].levels

    @cached_property
    def slack(self) -> float:
        """Standard deviation of the first step, m: a part of the least spacing of two rods."""
        return self.record.pitch / PART

    @cached_property
    def sigma(self) -> Array:
        """Standard deviation of each expected edge in the last step, m.

        All unknowns that move levels count as scatter.
        """
        scales, levels = self.model.components, self.model.slopes[self.role].levels
        own = np.hypot(scales.floor, scales.departure * (self.record.ratios is not None))
        variance = own**2 + levels**2 @ self.model.unknowns.sd**2
        return np.asarray(np.minimum(_BROADER * np.sqrt(variance), self.slack))

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of the unknowns: drag and gravity stay positive."""
        protocol, size = self.model.protocol, self.columns.size
        low, high = np.full(size, -np.inf), np.full(size, np.inf)
        low[START] = LOWEST_START - protocol.drop.value
        low[PULL] = -0.9 * protocol.gravity.value
        low[DRAG] = FAINT - prior_air(protocol)[0]  # below FAINT, formulas without drag apply
        low[ALPHA:], high[ALPHA:] = ANY_ALPHA - np.clip(self.record.alpha, *ANY_ALPHA)
        exact = self.sd == 0.0
        unit = np.where(exact, 1.0, self.sd)
        return np.where(exact, -np.inf, low / unit), np.where(exact, np.inf, high / unit)

    def unknowns(self, falls: Array) -> Array:
        """Return the drop's unknowns for falls released at time zero, shape ``(…, unknowns)``."""
        x = np.zeros((*falls.shape[:-1], len(self.model.unknowns)))
        x[..., self.columns[START:]] = (falls * self.sd)[..., START:]
        x[..., self.columns[ALPHA:]] += self.record.alpha
        return x

    def path(self, falls: Array) -> Trajectory:
        """Return the trajectories of falls released at time zero."""
        return self.model.trajectory(self.role, self.unknowns(falls))

    def since(self, falls: Array, times: Array) -> Array:
        """Return the true time since the release for stamped times, s.

        The clock's rate counts from the release: over hours since the fire, rate and release time
        could not be separated.
        """
        rate: Array = 1.0 + falls[:, CLOCK, None] * self.sd[CLOCK]
        return (times - falls[:, RELEASE, None]) * rate

    def sights(self, falls: Array, since: Array) -> tuple[Array, Array, Array]:
        """Return heights and speeds, and derivatives of heights by all unknowns of a fall.

        Parameters
        ----------
        since
            True times since the release, s, shape ``(falls, times)``.

        Returns
        -------
        ndarray, ndarray, ndarray
            m, m/s; shape ``(falls, times)``, and ``(falls, times, columns)``.
        """
        by = self.model.slopes[self.role].path[:, self.columns] * self.sd
        height, speed, slopes = self.path(falls).sights(since, by)
        # The clock's rate may be taken as 1 in these derivatives.
        slopes[..., CLOCK] = -speed * since * self.sd[CLOCK]
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
        own, (low, high) = self.sigma, self.bounds
        prior = np.diag(np.where(np.arange(self.columns.size) == RELEASE, 1e-9, 1.0))
        y = np.clip(falls, low, high)
        for step in range(_STEPS):
            width = np.maximum(own, self.slack * 0.5**step)
            since = self.since(y, self.record.edges.times)
            height, speed, slopes = self.sights(y, since)
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
        sigma = self.sigma[sides]
        off = height[edges[sides]] - self.levels[sides]
        absent = self.record.due.absent[sides]
        evidence = float(log_density(off, sigma, speed[edges[sides]], absent).sum() - lost)
        scatter = math.sqrt(float(((off / sigma) ** 2).sum()) / max(1, sides.size))
        x = self.unknowns(fall)
        x[self.columns[RELEASE]] = fall[RELEASE] * (1.0 + x[self.columns[CLOCK]])
        return FallFit(
            x, {self.role: edges}, evidence if math.isfinite(evidence) else -math.inf, scatter
        )

    def nodes(self, most: int = _NODES) -> Array:
        """Return the grid of starting points, the likeliest first, and no more than `most`.

        The grid is fine enough that, with the release free, every fall is within the first step's
        σ of a grid point.
        """
        low, high = self.bounds
        stated = np.clip(np.zeros((1, self.columns.size)), low, high)
        times = self.path(stated).times(self.levels)
        _, begin, slopes = (part[0] for part in self.sights(stated, times))
        slopes -= np.outer(begin, begin @ slopes) / max(float(begin @ begin), 1e-12)
        effects = np.abs(slopes).max(axis=0, initial=0.0) / (2.0 * self.slack)
        grid = stated
        for name in range(START, self.columns.size):
            if steps := int(_FAR * effects[name] + 0.5):
                axis = np.arange(-steps, steps + 1) / max(effects[name], steps / _FAR)
                grid = np.repeat(grid, axis.size, axis=0)
                grid[:, name] += np.tile(axis, len(grid) // axis.size)
                # Points outside the radius cannot come back inside with further unknowns.
                unlikely = (grid * grid).sum(axis=1)
                order = np.argsort(unlikely, kind="stable")[:most]
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
        nodes, size = self.nodes(), 2 * PEAKS
        while len(nodes):
            batch, nodes = nodes[:size], nodes[size:]
            size *= 2
            falls, votes = self._count_votes(batch, earliest)
            enough = (votes > 0) & (votes >= max(least, LEAST * votes.max(initial=0)))
            order = np.flatnonzero(enough)[np.argsort(-votes[enough], kind="stable")][: 4 * PEAKS]
            yield falls[order[self._unlike(falls[order])] if order.size else order]

    def most_votes(self) -> int:
        """Return the most votes for any fall of the grid's first, likeliest batch."""
        return int(self._count_votes(self.nodes(2 * PEAKS))[1].max(initial=0))

    def most_matches(self) -> int:
        """Return how many edges agree, each with a side of its own, with the fall of most votes."""
        falls, votes = self._count_votes(self.nodes(2 * PEAKS))
        fall, (edge, side) = falls[np.argsort(-votes)[:1]], self.pairing.pairs
        heights = self.path(fall).heights(self.since(fall, self.record.edges.times))[0]
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
        times, lasts = np.sort(self.record.edges.times), (late - early)[late > early]
        if not times.size or not lasts.size:
            return nodes[:0], np.zeros(0, dtype=np.intp)
        # A record may last hours: search the part with most edges, as long as the longest fall.
        until = np.searchsorted(times, times + late.max(), side="right")
        first = int(np.argmax(until - np.arange(times.size)))
        begin = max(float(times[first] - late.max()), earliest)
        end = float(times[until[first] - 1] - early.min())
        if end < begin:
            return nodes[:0], np.zeros(0, dtype=np.intp)
        # Two bins for each vote at the fastest passage.
        step = float(lasts.min()) / 2.0
        bins = int((end - begin) / step) + 2
        came = np.rint(np.clip((self.record.edges.times - begin) / step, -1e9, 1e9)).astype(np.intp)
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
            peak[:, RELEASE] = begin + step * (at + 1.0)
            table[row[:, None], np.clip(at[:, None] + near, 0, bins)] = 0
        return falls.reshape(-1, self.columns.size), np.concatenate(counts)

    def _unlike(self, falls: Array) -> list[int]:
        """Return the first falls whose assignment of edges differs from that of all before."""
        chosen: list[int] = []
        height, speed = self.path(falls).heights(self.since(falls, self.record.edges.times))
        side, _, _, weight = self.pairing.weights(self.levels, height, speed, self.slack)
        rods = np.where(weight > 0.5, side, -1).max(axis=2)
        for n, sides in enumerate(rods):
            alike = ((rods[chosen] == sides) & (sides >= 0)).sum(axis=1)
            if len(chosen) < PEAKS and (alike <= LEAST * (sides >= 0).sum()).all():
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
        matrix = np.where(free, matrix, np.eye(low.shape[-1]))
        change = np.linalg.solve(matrix, gradient[..., None])[..., 0]
    return np.asarray(change)
