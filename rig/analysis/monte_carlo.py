"""Propagation of distributions through the adjustment of a drop, or of a session (JCGM 101)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import islice
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rig.analysis.adjust import adjust
from rig.analysis.distributions import coverage_factor
from rig.analysis.joint_step import joint_step, take
from rig.analysis.plain_data import attributes
from rig.analysis.quantities import measurands
from rig.analysis.unknowns import ANYTHING
from rig.threads import one_thread

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from rig.analysis.drop_model import DropModel
    from rig.analysis.fit import Fit
    from rig.analysis.joint_fit import JointFit
    from rig.analysis.joint_step import JointDrop
    from rig.analysis.result import Measured

    Array = NDArray[np.float64]

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
        for one in drawn:
            for name, value in one.items():
                values.setdefault(name, []).append(value)
        return {name: cls.of(np.array(each)) for name, each in values.items()}

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
    fit: Fit, measured: Mapping[str, Measured], seed: int, first: int = FIRST, most: int = MOST
) -> tuple[dict[str, Propagated], int]:
    """Like `monte_carlo`, with twice as many trials until all results agree, or do not.

    Parameters
    ----------
    measured
        What the drop says by itself, see `agreement`.
    first, most
        With how many trials to begin and to end, whether they can tell then or not.

    Returns
    -------
    found, trials
    """
    drawn = _drawn(fit, seed)
    every: list[Mapping[str, float]] = []
    while True:
        every += islice(drawn, min(max(first, len(every)), most - len(every)))
        found = Propagated.all(every)
        if len(every) >= most or all(
            agreement(measured[name].value, measured[name].u, one, len(every)).decided
            for name, one in found.items()
        ):
            return found, len(every)


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
    every: list[Mapping[str, float]] = []
    blocks: list[dict[str, Propagated]] = []
    while True:
        new = list(islice(drawn, block))
        every += new
        blocks.append(Propagated.all(new))
        found = Propagated.all(every)
        if all(
            _stable([one[name] for one in blocks if name in one], tolerance(whole.u, digits))
            for name, whole in found.items()
        ):
            return found, len(every)


def _stable(blocks: Sequence[Propagated], within: float) -> bool:
    if len(blocks) < 2:
        return False
    ends = [list(one.json().values()) for one in blocks]
    errors = np.std(ends, axis=0, ddof=1) / math.sqrt(len(blocks))
    return bool(2.0 * errors.max() <= within)


def _drawn(fit: Fit, seed: int) -> Iterator[dict[str, float]]:
    """Make one trial after another."""
    rng = np.random.default_rng(seed)
    model, at = fit.model, fit.estimate.x
    sd = model.unknowns.sd
    # A restless drop was weighed by its own scatter, so that is what its edges are shaken by.
    scatter = _scatters(fit, fit.estimate.scatter)
    while True:
        moved = {role: one.draw(rng) for role, one in scatter.items()}
        centre = _stated(sd) * rng.normal(size=sd.size)
        shaken = model.shaken(moved)
        estimate = adjust(shaken, fit.matches, at, centre)
        yield _values(shaken, estimate.x)


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
    scatters = [_scatters(drop) for drop in joint.drops]
    found: list[list[dict[str, float]]] = [[] for _ in joint.drops]
    for _ in range(trials):
        centre = _stated(joint.sd) * rng.normal(size=joint.sd.size)
        states, x = [], joint.x
        for drop, scatter in zip(joint.drops, scatters, strict=True):
            sd = drop.model.unknowns.sd[drop.own]
            own = _stated(sd) * rng.normal(size=sd.size)
            moved = {role: one.draw(rng) for role, one in scatter.items()}
            states.append(replace(drop, model=drop.model.shaken(moved), centre=own))
        for _step in range(_SESSION_STEPS):
            root, states = joint_step(states, x, joint.sd, centre)
            x, states = take(states, x, joint.sd, root.step())
        for one, values in zip(states, found, strict=True):
            values.append(_values(one.model, one.x))
    return [Propagated.all(values) for values in found]


def _values(model: DropModel, x: Array) -> dict[str, float]:
    return {name: one.value for name, one in measurands(model, x).items()}


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


def _stated(sd: Array) -> Array:
    """Leave out what is not known at all: there is nothing to draw."""
    return np.where(sd < ANYTHING, sd, 0.0)


class _Scatter(NamedTuple):
    """What the edges of one side are shaken by.

    Attributes
    ----------
    all
        Number of observed edges.
    edges
        Places of the matched ones; shape ``(matched,)`` as of all that follows.
    speed
        Of the chain, m/s: m at the beam are s in the stamp.
    sigma, told
        As of `rig.analysis.equations.Equations`.
    """

    all: int
    edges: NDArray[np.intp]
    speed: Array
    sigma: Array
    told: Array

    def draw(self, rng: np.random.Generator) -> Array:
        """Draw by how much every observed edge moves, s; what is not matched stays."""
        off = self.sigma * rng.normal(size=self.sigma.size)
        off[1:] += self.told[1:] * off[:-1]  # the one before is the first of its pair, or told is 0
        found = np.zeros(self.all)
        found[self.edges] = off / self.speed
        return found


def _scatters(drop: Fit | JointDrop, scale: float = 1.0) -> dict[str, _Scatter]:
    found = {}
    for role, matches in drop.matches.items():
        rows = drop.model.equations(role, drop.x, matches)
        expected = drop.model.expected[role]
        found[role] = _Scatter(
            expected.times.size,
            expected.chosen(matches)[1],
            rows.residuals.speed,
            rows.residuals.sigma * scale,
            rows.told,
        )
    return found
