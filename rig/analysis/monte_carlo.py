"""Propagation of distributions through the fit of a drop by Monte Carlo trials (JCGM 101)."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator

from rig.analysis.adjust import adjust
from rig.analysis.annealing import matched
from rig.analysis.distributions import coverage_factor
from rig.analysis.drop_model import DropModel
from rig.analysis.fit import Fit
from rig.analysis.quantities import measurands
from rig.arrays import Array
from rig.threads import one_thread

PROBABILITY = 0.95
_END = 2.7
"""Standard error of the end of a 95 % interval from M trials, in units of u/√M: the quantile of a
normal distribution, √(p(1 − p))/density at p = 0.025."""


class TrialStats(NamedTuple):
    """Distribution of a quantity over all trials.

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
    def of(cls, values: Array) -> TrialStats:
        """Return the distribution of trials, shape ``(trials,)``."""
        low, high = np.quantile(values, [0.5 * (1.0 - PROBABILITY), 0.5 * (1.0 + PROBABILITY)])
        return cls(float(values.mean()), float(values.std(ddof=1)), float(low), float(high))


@one_thread
def monte_carlo(
    fit: Fit, trials: int, seed: int, show: Callable[[int, int], None] = lambda _done, _of: None
) -> dict[str, TrialStats]:
    """Return the distribution of each measurand from trials with drawn errors, by JSON name.

    Each trial shifts every edge by its scatter and every prior mean by its standard uncertainty,
    and fits the drop again. Unknowns without a prior are not drawn.

    Parameters
    ----------
    fit
        A drop fitted by itself.
    trials
        M of JCGM 101, at least 2.
    seed
        Seed of the generator; the same seed gives the same trials.
    show
        Called with the number of trials done and of all.
    """
    rng, at, sd = np.random.default_rng(seed), fit.estimate.x, fit.model.unknowns.sd
    values: dict[str, list[float]] = {}  # a shifted top rod may never strike
    for trial in range(1, trials + 1):
        shaken = _shake(fit, rng)
        fitted = adjust(shaken, fit.matches, at, centre=sd * rng.normal(size=sd.size)).x
        for name, dual in measurands(shaken, fitted).items():
            values.setdefault(name, []).append(dual.value)
        show(trial, trials)
    return {name: TrialStats.of(np.array(drawn)) for name, drawn in values.items()}


def agreement(
    value: float, u: float, drawn: TrialStats, trials: int, digits: int = 1
) -> dict[str, Any]:
    """Compare value ± 1.96 u with the interval of the trials (JCGM 101, clause 8).

    Parameters
    ----------
    digits
        Significant digits of u that the tolerance stands for.

    Returns
    -------
    dict
        ``d_low`` and ``d_high``, distance between the ends of the two 95 % intervals;
        ``tolerance``; ``error``, twice the standard error of an interval's end from this number of
        trials; ``agrees``, whether both ends are within the tolerance, and ``decided``, whether
        there are enough trials to decide that.
    """
    half, error = coverage_factor(math.inf, PROBABILITY) * u, 2.0 * _END * u / math.sqrt(trials)
    low, high = abs(value - half - drawn.low), abs(value + half - drawn.high)
    # Half a unit of the last significant digit of u (JCGM 101, 7.9.2).
    tolerance, off = 0.5 * 10.0 ** (math.floor(math.log10(u)) + 1 - digits), max(low, high)
    sizes = {"d_low": low, "d_high": high, "tolerance": tolerance, "error": error}
    return sizes | {"agrees": off <= tolerance, "decided": abs(off - tolerance) > error}


def _shake(fit: Fit, rng: Generator) -> DropModel:
    """Return the drop's model with edges shifted by the scatter that the fit estimated."""
    times = {}
    for role, match in fit.matches.items():
        rows = fit.model.equations(role, fit.x, match)
        sigma = rows.residuals.sigma * fit.estimate.scatter
        off = sigma * rng.normal(size=sigma.size)
        off[1:] += rows.told[1:] * off[:-1]  # told is 0 but for the second edge of a pair
        times[role] = np.zeros(fit.model.records[role].edges.times.size)
        times[role][matched(match)[1]] = off / rows.residuals.speed  # m at a beam to s
    return fit.model.shaken(times)
