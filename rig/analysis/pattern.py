"""A first guess of the fall from edges that nobody has matched yet.

Every pair of an observed and an expected edge votes for a release time; only the true one is
voted for by all rods at all gates, because a pattern shifted by one rod has other speeds. What
the impacts do is then found by trying one α after another.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.analysis.components import STATED
from rig.analysis.free_flight import fall_for, fall_through, leg_slopes
from rig.analysis.unknowns import DRAG_U

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from rig.analysis.chain_records import ChainRecord
    from rig.protocol.protocol import Protocol
    from rig.units import Quantity

    Array = NDArray[np.float64]
    Index = NDArray[np.intp]

ALPHAS = np.arange(-0.10, 0.601, 0.01)
"""Impact coefficients that are tried: beyond both ends of what energy allows."""
_LONGEST = 5e-3  # half width of a vote, s: at the very start a chain is too slow to tell more
_ROUGH = 1e-3  # how far off a rod may be in a first guess, m
_STEPS = 6
_APART = 8e-3  # release times further apart than this are different answers, s


class Air(NamedTuple):
    """What is known of κ beforehand, 1/m: where to begin, and its standard uncertainty.

    With no uncertainty it stays as it is.
    """

    kappa: float = 0.0
    u: float = 0.0


NO_AIR = Air()
_AIRS = tuple(0.02 * n for n in range(1, 11))  # of which one brings a chain near enough
_CLEAR = 0.9  # share of the expected edges with which no other κ is tried

_FELT = 2e-3  # 1/m: less than a millimetre in a first guess


@dataclass(frozen=True, slots=True)
class Guess:
    """A first guess and how well the edges support it.

    Attributes
    ----------
    release
        s since the release fired.
    start
        Height of the reference point before release, m.
    alpha
        Of all impacts; 0 for a free chain.
    share
        Share of the expected edges that are where they should be.
    runner_up
        The same for the best guess that is a really different one.
    kappa
        Of the air, 1/m.
    """

    release: float
    start: float
    alpha: float = 0.0
    share: float = 0.0
    runner_up: float = 0.0
    kappa: float = 0.0


def guess(record: ChainRecord, start: Quantity, gravity: float, air: Air = NO_AIR) -> Guess:
    """Guess the release time, κ of the air, and α where the chain is struck.

    Parameters
    ----------
    start
        Height of the reference point before release, m.
    air
        What is known of κ.
    """
    places = np.array(record.chain.chain.heights)
    pitch = float(np.diff(places).min()) if places.size > 1 else start.value
    slack = pitch / 6  # either way: what is a rod off is well outside
    # An impact chain falls freely until its bottom rod is down.
    lowest = -np.inf if record.ratios is None else 0.0
    free = guess_release(record, start, gravity, lowest, slack, air)
    for kappa in _AIRS if air.u and free.share < _CLEAR else ():
        other = guess_release(record, start, gravity, lowest, slack, Air(kappa, air.u))
        free = max(free, other, key=lambda one: one.share)
    if record.ratios is None or free.share == 0.0:
        return free
    return _alpha(record, gravity, record.ratios, slack, pitch, free)


def first_guesses(protocol: Protocol, records: Sequence[ChainRecord]) -> dict[str, Guess]:
    """Guess each side's fall."""
    gravity, start = protocol.gravity.value, protocol.drop
    # The free chain tells what the air does to both.
    air = Air(0.0, DRAG_U) if air_is_told(records) else NO_AIR
    found: dict[str, Guess] = {}
    for record in reversed(records):  # the free chain first
        found[record.role] = guess(record, start, gravity, air)
        kappa = found[record.role].kappa
        air = Air(kappa) if abs(kappa) > _FELT else NO_AIR
    return {record.role: found[record.role] for record in records}


def air_is_told(records: Sequence[ChainRecord]) -> bool:
    """Whether κ can be told from what is struck: by a free chain, of rods that are all alike."""
    return len(records) > 1 and all(record.chain.chain.alike for record in records)


def guess_release(
    record: ChainRecord,
    start: Quantity,
    gravity: float,
    lowest: float,
    slack: float,
    air: Air = NO_AIR,
) -> Guess:
    """Let all pairs vote and count at the moment that most of them agree on."""
    times, levels, _ = _pairs(record, lowest)
    if times.size == 0:
        return Guess(0.0, start.value)
    speed, tau = fall_through(start.value - levels, np.zeros_like(levels), gravity, air.kappa)
    middle = times - tau
    # A level passed fast tells the moment better; before it moves, a chain tells hardly anything.
    half = np.minimum(slack / np.maximum(speed, slack / _LONGEST), _LONGEST)
    begins = times.size  # the first so many of all ends of votes
    moments = np.concatenate([np.sort(middle - half), np.sort(middle + half)])
    order = np.argsort(moments, kind="stable")  # what begins comes before what ends then
    moments = moments[order]
    votes = np.cumsum(np.where(order < begins, 1, -1))  # just after each
    best = int(np.argmax(votes))
    release = 0.5 * float(moments[best] + moments[best + 1])
    voters = np.abs(middle - release) <= half
    expected = sum(int((train.levels > lowest).sum()) for train in record.trains)
    elsewhere = votes[np.abs(moments - release) > _APART].max(initial=0)
    most = float(votes[best])
    release, height, kappa = _refine(times[voters], levels[voters], release, start, gravity, air)
    return Guess(
        release,
        height,
        share=min(1.0, most / expected),
        runner_up=float(elsewhere) / expected,
        kappa=kappa,
    )


class Pairs(NamedTuple):
    """Every edge with every expected edge of its gate and polarity, shape ``(pairs,)`` each.

    Attributes
    ----------
    times
        Of the edge, s.
    levels
        Of the expected edge, m.
    expected
        Number of the expected edge, counted over all gates.
    """

    times: Array
    levels: Array
    expected: Index


def _pairs(record: ChainRecord, lowest: float) -> Pairs:
    """Pair up everything whose level is above `lowest`."""
    times, levels, numbers, first = [], [], [], 0
    for train in record.trains:
        same = train.blocked[:, None] == train.blocks[None, :]
        observed, expected = np.nonzero(same & (train.levels > lowest)[None, :])
        times.append(train.times[observed])
        levels.append(train.levels[expected])
        numbers.append(first + expected)
        first += train.rods.size
    return Pairs(np.concatenate(times), np.concatenate(levels), np.concatenate(numbers))


def _refine(
    times: Array, levels: Array, release: float, start: Quantity, gravity: float, air: Air
) -> tuple[float, float, float]:
    """Fit release time, start height and κ to the pairs that voted for them."""
    offset, kappa = 0.0, air.kappa
    # Of the release nothing is known; the others are held: early edges hardly tell all three apart.
    prior = np.array([0.0, (_ROUGH / max(start.u, STATED.hang)) ** 2, 0.0])
    prior[2] = (_ROUGH / air.u) ** 2 if air.u else 1.0
    for _ in range(_STEPS):
        since = np.maximum(times - release, 0.0)
        still = np.zeros_like(since)
        fallen, speed, _, _, by_kappa = leg_slopes(since, still, gravity, kappa)
        residual = start.value + offset - fallen - levels
        # Votes by chance are among the voters: beyond 2 mm they pull no harder than at 2 mm.
        weight = np.minimum(1.0, 2.0 * _ROUGH / np.maximum(np.abs(residual), _ROUGH))
        slopes = np.stack([speed, np.ones_like(since), -by_kappa if air.u else still])
        right = slopes @ (weight * residual) + prior * [0.0, offset, kappa if air.u else 0.0]
        step = np.linalg.solve((slopes * weight) @ slopes.T + np.diag(prior), right)
        release, offset, kappa = release - step[0], offset - step[1], kappa - step[2]
    return float(release), start.value + float(offset), float(kappa)


def _alpha(
    record: ChainRecord, gravity: float, ratios: Array, slack: float, pitch: float, free: Guess
) -> Guess:
    """Try one α after another."""
    places = np.array(record.chain.chain.heights)
    time, height, speed = _paths(free, gravity, ratios, places)
    scores = _scores(record, time, height, speed, gravity, slack, free.kappa)
    # The middle of a plateau, not its left end.
    plateau = np.flatnonzero(scores == scores.max())
    best = int(plateau[plateau.size // 2])
    # Where the chain of each other α is when the best one's top rod strikes.
    end = time[-1, best]
    leg = np.clip((time <= end).sum(axis=0) - 1, 0, None)
    since = end - time[leg, range(ALPHAS.size)]
    at = height[leg] - fall_for(since, speed[leg, range(ALPHAS.size)], gravity, free.kappa)[0]
    # Neighbouring α give the same edges the same rods: only another matching is another answer.
    different = np.abs(at - at[best]) > pitch / 2
    return replace(
        free,
        alpha=float(ALPHAS[best]),
        share=min(free.share, float(scores[best]) / record.expected),
        runner_up=float(scores[different].max(initial=0)) / record.expected,
    )


def _paths(free: Guess, gravity: float, ratios: Array, places: Array) -> tuple[Array, Array, Array]:
    """Times and speeds at the beginning of each leg for every α, shape ``(legs, alphas)``."""
    legs = places.size + 1
    time, speed = np.empty((legs, ALPHAS.size)), np.zeros((legs, ALPHAS.size))
    height = np.concatenate([[free.start], -places])
    time[0] = free.release
    for k, ratio in enumerate(ratios):
        distance = height[k] - height[k + 1]
        arrival, lasted = fall_through(distance, speed[k], gravity, free.kappa)
        time[k + 1] = time[k] + lasted
        speed[k + 1] = arrival * (1.0 + ALPHAS * ratio)
    return time, height, speed


def _scores(
    record: ChainRecord,
    time: Array,
    height: Array,
    speed: Array,
    gravity: float,
    slack: float,
    kappa: float,
) -> Index:
    """Count for every α the expected edges that have an observed one where the chain would be."""
    levels = np.concatenate([train.levels for train in record.trains])
    soonest = _passages(levels + slack, time, height, speed, gravity, kappa)
    latest = _passages(levels - slack, time, height, speed, gravity, kappa)
    times, _, expected = _pairs(record, -np.inf)
    # The larger α, the sooner: most pairs are beyond what any of them reaches.
    near = np.flatnonzero((soonest[expected, -1] < times) & (times < latest[expected, 0]))
    near = near[np.argsort(expected[near], kind="stable")]
    number, when = expected[near], times[near, None]
    hit = (soonest[number] < when) & (when < latest[number])
    if not number.size:
        return np.zeros(time.shape[1], dtype=np.intp)
    begins = np.flatnonzero(np.diff(number, prepend=-1))
    scores: Index = np.logical_or.reduceat(hit, begins).sum(axis=0)
    return scores


def _passages(
    levels: Array, time: Array, height: Array, speed: Array, gravity: float, kappa: float
) -> Array:
    """When each path comes down to each level, shape ``(levels, paths)``; −∞ above the start."""
    leg = np.maximum(np.searchsorted(-height, -levels, side="right") - 1, 0)
    distance = np.maximum(height[leg] - levels, 0.0)[:, None]
    passed = time[leg] + fall_through(distance, speed[leg], gravity, kappa)[1]
    passed[levels > height[0]] = -np.inf
    return passed
