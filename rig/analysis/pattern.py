"""Where a fall may begin, by edges that nobody has matched yet.

For every α, and every height and air that must be tried, the model says when each expected edge
comes after the release. Every edge of a gate then votes for a release time with every expected edge
that it could be: all rods at all gates vote for the true one, and many for those that are a rod
off. All moments with many votes are kept; `rig.analysis.identify` judges between them.
"""

from __future__ import annotations

import heapq
import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.analysis.free_flight import fall_through, lasting, reach_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from numpy.typing import NDArray

    from rig.analysis.chain_records import ChainRecord
    from rig.units import Quantity

    Array = NDArray[np.float64]
    Index = NDArray[np.intp]
    Counts = NDArray[np.int32]

Span = tuple[float, float]

EVER: Span = (-np.inf, np.inf)
ANY_ALPHA: Span = (-0.10, 0.60)
"""Impact coefficients beyond both ends of what energy allows."""
AIRS = tuple(0.02 * n for n in range(1, 11))
"""κ that are tried where none is known and a fall in vacuum explains too little, 1/m."""
_MOST = 8e-3  # how far off a rod may be and still vote, m
_PART = 6.0  # and what part of the least distance of two rods: what is a rod off is well outside
LONGEST = 5e-3  # half width of a vote, s: at the very start a chain is too slow to tell more
_SHORTEST = 0.05e-3
_SURE = 2.5  # standard uncertainties of the drop height within which starts are tried
_FEWEST = 0.5  # of the most votes, below which a moment is not kept
_RECORD = 4.0  # s: what longer a record is, is only searched where most of its edges are
_FEW = 4  # edges of one kind, below which their order tells nothing
_NEAR = 0.08  # how far α may be from what the model expects, and be found at once
_KEPT = 8  # moments
_CELLS = 100_000  # votes counted together: they stay where a processor has them at hand
_BLOCK = 8  # falls of neighbouring α of which it is asked first whether any has votes enough
_MANY = 4 * _BLOCK  # falls beyond which that is worth asking


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
    votes
        How many expected edges have one near where this fall puts them.
    """

    release: float
    start: float
    alpha: float = 0.0
    kappa: float = 0.0
    clock: float = 0.0
    votes: int = 0
    pull: float = 0.0


class _Paths(NamedTuple):
    """Falls of one chain from a release at zero, one a column.

    Attributes
    ----------
    alphas
        Shape ``(paths,)``.
    times, speeds
        At each expected edge; NaN where a path never comes by; shape ``(expected, paths)``.
    end
        When the last of them passes, shape ``(paths,)``.
    """

    alphas: Array
    times: Array
    speeds: Array
    end: Array


def slack_of(record: ChainRecord) -> float:
    """How far off a rod may be in a first guess, m."""
    places = np.array(record.chain.chain.heights)
    pitch = float(np.diff(places).min()) if places.size > 1 else np.inf
    return min(pitch / _PART, _MOST)


def guesses(
    record: ChainRecord,
    start: Quantity,
    gravity: float,
    kappa: float = 0.0,
    clock: float = 0.0,
    window: Span = EVER,
    alphas: Span = ANY_ALPHA,
    least: float = 0.0,
) -> Iterator[Guess]:
    """Find all moments for which many edges of a chain vote, those with the most first.

    Each is sought only when it is asked for.

    Parameters
    ----------
    start
        Height of the reference point before release, m; those within its uncertainty are tried.
    kappa, clock
        Of all falls that are tried.
    window
        Within which the release must be, s.
    alphas
        Impact coefficients to try.
    least
        Votes without which a moment need not be found.
    """
    slack = slack_of(record)
    pairs = _pairs(record, clock)
    if pairs.times.size == 0:
        return

    def begun_at(height: float) -> Iterator[Guess]:
        tried = _alphas(record, height, gravity, kappa, slack, alphas)
        paths = _paths(record, height, gravity, kappa, tried)
        for release, path, votes in _moments(pairs, paths, slack, window, least):
            yield Guess(release, height, float(paths.alphas[path]), kappa, clock, votes)

    most = 0
    for one in itertools.islice(merged(*map(begun_at, _heights(start, slack))), _KEPT):
        most = max(most, one.votes)
        if one.votes < _FEWEST * most:
            return
        yield one


def _heights(start: Quantity, slack: float) -> list[float]:
    """Starts above the contact point to try, so that one is near enough; the stated one first."""
    steps = int(np.ceil(max(0.0, _SURE * start.u - slack) / slack))
    tried = [start.value + slack * n for n in sorted(range(-steps, steps + 1), key=abs)]
    return [height for height in tried if height > 0.0]


class _Pairs(NamedTuple):
    """Every edge with every expected edge of its gate and polarity, shape ``(pairs,)`` each.

    Attributes
    ----------
    times
        Of the edge, s.
    expected
        Number of the expected edge, counted over all gates.
    """

    times: Array
    expected: Index


def _pairs(record: ChainRecord, clock: float) -> _Pairs:
    times, numbers, first = [np.zeros(0)], [np.zeros(0, dtype=np.intp)], 0
    for train in record.trains:
        observed, expected = np.nonzero(train.blocked[:, None] == train.blocks[None, :])
        times.append(train.times[observed])
        numbers.append(first + expected)
        first += train.rods.size
    return _Pairs(np.concatenate(times) * (1.0 + clock), np.concatenate(numbers))


def _alphas(
    record: ChainRecord, start: float, gravity: float, kappa: float, slack: float, span: Span
) -> Array:
    """Impact coefficients to try, so many that none between them is missed; 0 for a free chain."""
    if record.ratios is None:
        return np.zeros(1)
    time, _, speed = _legs(record, start, np.array(span), gravity, kappa)
    # So fine that the chain's top is never off by more than half a vote's width.
    apart = float((time[-1, 0] - time[-1, 1]) * speed[-1, 1])
    return np.linspace(*span, int(np.ceil(max(apart, 0.0) / slack)) + 2)


def _paths(
    record: ChainRecord, start: float, gravity: float, kappa: float, alphas: Array
) -> _Paths:
    """Let the chain fall with each α."""
    levels = np.concatenate([train.levels for train in record.trains])
    time, height, speed = _legs(record, start, alphas, gravity, kappa)
    air = kappa * np.broadcast_to(record.air, height.shape)
    times, speeds = _passages(levels, time, height, speed, gravity, air)
    end: Array = np.where(np.isnan(times), 0.0, times).max(axis=0, initial=0.0)
    return _Paths(alphas, times, speeds, end)


def _legs(
    record: ChainRecord, start: float, alphas: Array, gravity: float, kappa: float
) -> tuple[Array, Array, Array]:
    """Where each leg begins for every α: time, shape ``(legs, alphas)``, height, and speed."""
    if record.ratios is None:
        return np.zeros((1, 1)), np.array([start]), np.zeros((1, 1))
    height = np.concatenate([[start], -record.strikes])
    air = kappa * np.broadcast_to(record.air, height.shape)[:-1]
    reach = reach_of(height[:-1] - height[1:], air)
    left, gained = 1.0 - air * reach, gravity * reach
    factors = (1.0 + alphas * record.ratios[:, None]) ** 2
    # Squares of the speeds, before and after each impact.
    before, after = np.empty_like(factors), np.zeros((height.size, alphas.size))
    for k, factor in enumerate(factors):
        before[k] = left[k] * after[k] + gained[k]
        after[k + 1] = before[k] * factor
    time, speed = np.zeros_like(after), np.sqrt(np.maximum(after, 0.0))
    arrival = np.sqrt(np.maximum(before, 0.0))
    lasted = lasting(reach[:, None], speed[:-1], arrival, gravity, air[:, None])
    np.cumsum(lasted, axis=0, out=time[1:])
    return time, height, speed


def _passages(
    levels: Array, time: Array, height: Array, speed: Array, gravity: float, kappas: Array
) -> tuple[Array, Array]:
    """When each path comes down to each level, and how fast; NaN above the start."""
    leg = np.maximum(np.searchsorted(-height, -levels, side="right") - 1, 0)
    distance = np.maximum(height[leg] - levels, 0.0)[:, None]
    arrival, lasted = fall_through(distance, speed[leg], gravity, kappas[leg, None])
    passed = time[leg] + lasted
    passed[levels >= height[0]] = np.nan
    return passed, arrival


def _moments(
    pairs: _Pairs, paths: _Paths, slack: float, window: Span, least: float
) -> Iterator[tuple[float, int, int]]:
    """Yield release, path and number of votes of the moments with most votes that are apart."""
    # A level passed fast tells the moment better; before it moves, a chain tells hardly anything.
    half = np.clip(slack / np.maximum(paths.speeds, 1e-9), _SHORTEST, LONGEST)
    # The larger α, the sooner; a level that no path comes by is near no moment.
    soonest, latest = paths.times[:, -1], paths.times[:, 0]
    near = pairs.times - soonest[pairs.expected] >= window[0] - LONGEST
    near &= pairs.times - latest[pairs.expected] <= window[1] + LONGEST
    times, expected = pairs.times[near], pairs.expected[near]
    if times.size == 0:
        return
    times, expected = _densest(times, expected, soonest[expected], latest[expected])
    first = float((times - latest[expected]).min()) - 2.0 * LONGEST
    last = float((times - soonest[expected]).max()) + 2.0 * LONGEST
    first, last = max(first, window[0] - LONGEST), min(last, window[1] + LONGEST)
    step = float(half.min()) / 2.0
    bins = int((last - first) / step) + 2
    votes = np.zeros((paths.alphas.size, bins + 1), dtype=np.int32)
    # In bins; what never comes by votes before the first one.
    moments = (times - first) / step
    due = np.where(np.isnan(paths.times), np.inf, paths.times / step)
    half /= step
    tried = np.arange(paths.alphas.size)
    if least > 0.0 and tried.size > _MANY:
        # Whoever votes for one fall of a block votes for all of it together.
        begins = tried[::_BLOCK]
        widest = np.maximum.reduceat(half, begins, axis=1)
        ends = np.append(begins[1:], tried.size) - 1
        most = _votes(moments, expected, due[:, begins] + widest, due[:, ends] - widest, bins)
        tried = tried[np.repeat(most.max(axis=1) >= least, np.diff(begins, append=tried.size))]
    votes[tried] = _votes(moments, expected, (due + half)[:, tried], (due - half)[:, tried], bins)
    yield from _peaks(votes, paths, slack, first, step)


def _densest(times: Array, expected: Index, soonest: Array, latest: Array) -> tuple[Array, Index]:
    """Of pairs whose releases are spread over minutes, return those of the fullest part."""
    release = times - 0.5 * (soonest + latest)
    ordered = np.sort(release)
    held = np.searchsorted(ordered, ordered + _RECORD, side="right") - np.arange(ordered.size)
    first = ordered[int(np.argmax(held))]
    kept = (release >= first) & (release <= first + _RECORD)
    return times[kept], expected[kept]


def _votes(moments: Array, expected: Index, late: Array, soon: Array, bins: int) -> Counts:
    """Count for each fall and each bin how many pairs vote for a release then.

    Parameters
    ----------
    moments, expected
        Of each pair, in bins.
    late, soon
        How long after the release an expected edge comes at most and at least, in bins; shape
        ``(expected, falls)``.

    Returns
    -------
    ndarray
        Shape ``(falls, bins + 1)``.
    """
    found = np.zeros((late.shape[1], bins + 1), dtype=np.int32)
    block = max(1, _CELLS // moments.size)
    for begin in range(0, len(found), block):
        some = found[begin : begin + block]
        row = (bins + 1) * np.arange(len(some))
        for bounds, sign in ((late, 1), (soon, -1)):
            bound = moments[:, None] - bounds[expected, begin : begin + block]
            np.rint(bound, out=bound)
            # What is beyond all bins begins and ends in the same one, and counts nowhere.
            np.clip(bound, 0.0, bins, out=bound)
            place = bound.astype(np.intp)
            place += row
            counts = np.bincount(place.ravel(), minlength=some.size).astype(np.int32)
            some += sign * counts.reshape(some.shape)
    return np.cumsum(found, axis=1, dtype=np.int32)


def _peaks(
    votes: Counts, paths: _Paths, slack: float, first: float, step: float
) -> Iterator[tuple[float, int, int]]:
    """Yield the highest counts of which no two are the same fall to half a rod."""
    best = votes.max(axis=1)
    most = int(best.max())
    fastest = float(paths.speeds.max())
    apart = min(_PART / 2.0 * slack / fastest, LONGEST)
    moments = first + step * (np.arange(votes.shape[1]) + 0.5)
    yielded = 0
    while yielded < _KEPT:
        path = int(np.argmax(best))
        count = int(best[path])
        if count == 0 or count < _FEWEST * most:
            return
        # The middle of a plateau, not its beginning: over all α, then over all moments.
        at = int(np.argmax(votes[path]))
        alike = np.flatnonzero(votes[:, at] == count)
        runs = np.split(alike, 1 + np.flatnonzero(np.diff(alike) > 1))
        mine = next(run for run in runs if path in run)
        path = int(mine[mine.size // 2])
        end = at + int(np.argmin(votes[path, at:] == count))
        at = (at + max(end, at + 1) - 1) // 2
        yield float(moments[at]), path, count
        yielded += 1
        # A fall of another α that begins and ends with this one is the same.
        alike = np.abs(paths.end - paths.end[path]) < 2.0 * apart
        votes[np.ix_(alike, np.abs(moments - moments[at]) < apart)] = 0
        best[alike] = votes[alike].max(axis=1)


def near_alpha(record: ChainRecord) -> Span:
    """Impact coefficients not far from what the model expects of a chain."""
    return max(ANY_ALPHA[0], record.alpha - _NEAR), min(ANY_ALPHA[1], record.alpha + _NEAR)


def in_order(record: ChainRecord, start: float, gravity: float) -> Span:
    """Return about when a chain was let go if its edges came one by one as expected.

    The first edge of a gate is its first expected one and the last the last, but for few that were
    missed or did not belong: a window of some rods, which may be wrong.
    """
    paths = _paths(record, start, gravity, 0.0, np.array([record.alpha]))
    late, begin = [], 0
    for train in record.trains:
        due = paths.times[begin : begin + train.rods.size, 0]
        begin += train.rods.size
        for polarity in (True, False):
            seen, wanted = train.times[train.blocked == polarity], due[train.blocks == polarity]
            wanted = wanted[~np.isnan(wanted)]
            size = min(seen.size, wanted.size)
            if size >= _FEW:
                late += [middle(seen[:size] - wanted[:size])]
                late += [middle(seen[-size:] - wanted[-size:])]
    if not late:
        return EVER
    return min(late), max(late)


def middle(values: Array) -> float:
    """Return the upper median; much quicker than that of numpy."""
    return float(np.sort(values)[values.size // 2])


def merged(*several: Iterable[Guess]) -> Iterator[Guess]:
    """Put several rows of guesses in one, those with the most votes first, as each row has them."""
    return heapq.merge(*several, key=lambda one: -one.votes)
