"""Propagation of distributions through the adjustment of a drop, or of a session (JCGM 101)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import chain, islice, repeat
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.analysis.adjust import adjust
from rig.analysis.distributions import coverage_factor
from rig.analysis.joint_step import joint_step, take
from rig.analysis.plain_data import attributes
from rig.analysis.quantities import measurands
from rig.analysis.unknowns import ANYTHING
from rig.threads import one_thread

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from numpy.random import Generator

    from rig.analysis.drop_model import DropModel
    from rig.analysis.fit import Fit
    from rig.analysis.joint_fit import JointFit
    from rig.analysis.joint_step import JointDrop
    from rig.analysis.result import Measured
    from rig.arrays import Array


PROBABILITY = 0.95
BLOCK = 10_000
"""Trials of a block of the adaptive procedure, for up to 99 % (JCGM 101, 7.9.4)."""
FIRST, MOST = 200, 1600
"""Trials after which one looks whether they can tell, and after which one looks no more."""
_SESSION_STEPS = 3  # from the solution itself: a trial moves it by about one σ
_END = 2.7
"""Standard error of the end of a 95 % interval from M trials, in units of u/√M: the quantile of a
normal distribution, √(p(1 − p))/density at p = 0.025."""


@dataclass(frozen=True, slots=True)
class Propagated:
    """What became of one quantity.

    Attributes
    ----------
    mean, u
        Mean and standard deviation of all trials.
    low, high
        Ends of the probabilistically symmetric 95 % interval (JCGM 101, 7.7).
    """

    mean: float
    u: float
    low: float
    high: float

    @classmethod
    def of(cls, values: Array) -> Propagated:
        """Sum up the trials, shape ``(trials,)``."""
        tail = 0.5 * (1.0 - PROBABILITY)
        low, high = np.quantile(values, [tail, 1.0 - tail])
        return cls(float(values.mean()), float(values.std(ddof=1)), float(low), float(high))

    @classmethod
    def all(cls, drawn: Iterable[Mapping[str, float]]) -> dict[str, Propagated]:
        """Sum up trials of several quantities by name."""
        values: dict[str, list[float]] = {}
        for name, value in chain.from_iterable(trial.items() for trial in drawn):
            values.setdefault(name, []).append(value)
        return {name: cls.of(np.array(drawn_values)) for name, drawn_values in values.items()}

    def json(self) -> dict[str, float]:
        """``{"mean", "u", "low", "high"}``."""
        return attributes(self, *self.__slots__)


@one_thread
def monte_carlo(fit: Fit, trials: int, seed: int) -> dict[str, Propagated]:
    """Draw everything that is uncertain, and adjust again each time, with nothing linearised.

    Each trial moves every edge by its own scatter and every stated value by its standard
    uncertainty; of what is not known at all there is nothing to draw.

    Parameters
    ----------
    fit
        A drop adjusted by itself.
    trials
        M of JCGM 101, at least 2.
    seed
        Of the generator; the same seed gives the same trials.
    """
    return Propagated.all(islice(_drawn(fit, seed), trials))


@one_thread
def until_decided(
    fit: Fit, measured: Mapping[str, Measured], seed: int, first: int = FIRST, last: int = MOST
) -> tuple[dict[str, Propagated], int]:
    """Like `monte_carlo`, with twice as many trials until all results agree, or do not.

    Parameters
    ----------
    measured
        What the drop says by itself, see `agreement`.
    first, last
        With how many trials to begin and to end, whether they can tell then or not.

    Returns
    -------
    samples, trials
    """

    def decided(samples: Mapping[str, Propagated], _block: object, trials: int) -> bool:
        return all(
            agreement(measured[name].value, measured[name].u, drawn, trials).decided
            for name, drawn in samples.items()
        )

    sizes, done = [], 0
    while done < last:
        sizes.append(min(max(first, done), last - done))
        done += sizes[-1]
    return _draw_until(decided, _drawn(fit, seed), sizes)


@one_thread
def adaptive(
    fit: Fit, seed: int, digits: int = 1, block: int = BLOCK
) -> tuple[dict[str, Propagated], int]:
    """Like `monte_carlo`, with as many trials as the digits need that count (JCGM 101, 7.9.4).

    Parameters
    ----------
    digits
        Of u that count.
    block
        Trials that are looked at together; the Supplement's least is `BLOCK`.

    Returns
    -------
    found, trials
        M, a multiple of `block`.
    """
    return until_stable(_drawn(fit, seed), block, digits)


def until_stable(
    drawn: Iterator[Mapping[str, float]], block: int, digits: int = 1
) -> tuple[dict[str, Propagated], int]:
    """Draw blocks of trials until all results are stable to so many digits of u.

    That is: until twice the standard errors of mean, u and both ends of the interval, from block to
    block, are within the tolerance δ.
    """
    blocks: list[Mapping[str, Propagated]] = []

    def stable(results: Mapping[str, Propagated], block: Mapping[str, Propagated], _: int) -> bool:
        blocks.append(block)
        return all(
            _stable(
                [sample[name] for sample in blocks if name in sample], tolerance(total.u, digits)
            )
            for name, total in results.items()
        )

    return _draw_until(stable, drawn, repeat(block))


def _draw_until(
    enough: Callable[[Mapping[str, Propagated], Mapping[str, Propagated], int], bool],
    drawn: Iterator[Mapping[str, float]],
    sizes: Iterable[int],
) -> tuple[dict[str, Propagated], int]:
    """Draw blocks of trials until all of them, the last block and their number are enough."""
    trials: list[Mapping[str, float]] = []
    samples: dict[str, Propagated] = {}
    for size in sizes:
        block = list(islice(drawn, size))
        trials += block
        samples = Propagated.all(trials)
        if enough(samples, Propagated.all(block), len(trials)):
            break
    return samples, len(trials)


def _stable(blocks: Sequence[Propagated], within: float) -> bool:
    if len(blocks) < 2:
        return False
    ends = [list(sample.json().values()) for sample in blocks]
    errors = np.std(ends, axis=0, ddof=1) / math.sqrt(len(blocks))
    return bool(2.0 * errors.max() <= within)


def _drawn(fit: Fit, seed: int) -> Iterator[dict[str, float]]:
    """Make one trial after another."""
    rng = np.random.default_rng(seed)
    at, sd = fit.estimate.x, _drawable(fit.model.unknowns.sd)
    # A restless drop was weighed by its own scatter, so that is what its edges are shaken by.
    shake = _shaker(fit, fit.estimate.scatter)
    while True:
        shaken = shake(rng)
        centre = sd * rng.normal(size=sd.size)
        yield _values(shaken, adjust(shaken, fit.matches, at, centre).x)


@one_thread
def session_monte_carlo(joint: JointFit, trials: int, seed: int) -> list[dict[str, Propagated]]:
    """Draw everything that is uncertain about a session, and adjust all drops together again.

    As `monte_carlo`, with what drops have in common drawn once a trial. How much everything
    scatters is taken as the joint fit found it.

    Returns
    -------
    list
        For each jointly fitted drop, by JSON name.
    """
    rng = np.random.default_rng(seed)
    shakers = [_shaker(drop) for drop in joint.drops]
    values: list[list[dict[str, float]]] = [[] for _ in joint.drops]
    for _ in range(trials):
        centre = _drawable(joint.sd) * rng.normal(size=joint.sd.size)
        states, x = [], joint.x
        for drop, shake in zip(joint.drops, shakers, strict=True):
            sd = _drawable(drop.model.unknowns.sd[drop.own])
            own = sd * rng.normal(size=sd.size)
            states.append(replace(drop, model=shake(rng), centre=own))
        for _step in range(_SESSION_STEPS):
            root, states = joint_step(states, x, joint.sd, centre)
            x, states = take(states, x, joint.sd, root.step())
        for state, drawn in zip(states, values, strict=True):
            drawn.append(_values(state.model, state.x))
    return [Propagated.all(drawn) for drawn in values]


def _values(model: DropModel, x: Array) -> dict[str, float]:
    return {name: value.value for name, value in measurands(model, x).items()}


@dataclass(frozen=True, slots=True)
class Agreement:
    """Whether the GUM's framework is validated by the trials (JCGM 101, clause 8).

    Attributes
    ----------
    d_low, d_high
        How far the ends of the two 95 % intervals are apart.
    tolerance
        δ: half a unit of the last digit of u that counts (7.9.2).
    error
        Twice the standard error of the end of an interval that so many trials give.
    """

    d_low: float
    d_high: float
    tolerance: float
    error: float

    @property
    def agrees(self) -> bool:
        """Whether both ends are within the tolerance."""
        return max(self.d_low, self.d_high) <= self.tolerance

    @property
    def decided(self) -> bool:
        """Whether that is more than chance: so few trials may say either."""
        return abs(max(self.d_low, self.d_high) - self.tolerance) > self.error

    def json(self) -> dict[str, Any]:
        """``{"d_low", "d_high", "tolerance", "error", "agrees", "decided"}``."""
        return attributes(self, *self.__slots__, "agrees", "decided")


def tolerance(u: float, digits: int = 1) -> float:
    """δ: half a unit of the last digit of u that counts (JCGM 101, 7.9.2)."""
    return 0.5 * 10.0 ** (math.floor(math.log10(u)) + 1 - digits)


def agreement(value: float, u: float, drawn: Propagated, trials: int, digits: int = 1) -> Agreement:
    """Compare value ± 1.96 u with the interval of the trials, to so many digits of u."""
    half = coverage_factor(math.inf, PROBABILITY) * u
    return Agreement(
        abs(value - half - drawn.low),
        abs(value + half - drawn.high),
        tolerance(u, digits),
        2.0 * _END * u / math.sqrt(trials),
    )


def _drawable(sd: Array) -> Array:
    """Leave out what is not known at all: there is nothing to draw."""
    return np.where(sd < ANYTHING, sd, 0.0)


def _shaker(drop: Fit | JointDrop, scale: float = 1.0) -> Callable[[Generator], DropModel]:
    """Return what draws by how much every matched edge moves, with a scatter so much larger."""
    sides = []
    for role, matches in drop.matches.items():
        rows, pairing = drop.model.equations(role, drop.x, matches), drop.model.pairings[role]
        moved = pairing.observed(matches)[1], rows.residuals.speed, rows.residuals.sigma * scale
        sides.append((role, pairing.times.size, *moved, rows.told))

    def shake(rng: Generator) -> DropModel:
        times = {}
        for role, size, edges, speed, sigma, carried in sides:
            off = sigma * rng.normal(size=sigma.size)
            off[1:] += carried[1:] * off[:-1]  # the one before is first of its pair, or that is 0
            times[role] = np.zeros(size)
            times[role][edges] = off / speed  # m at the beam are s in the stamp
        return drop.model.shaken(times)

    return shake
