"""Comparison of results with the model: the source of every Eₙ, χ² and p.

The difference of measured and predicted value is a measurand of its own. Its uncertainty includes
measurement, the model's coefficients, and the scatter of single falls about their mean, which for
the mean of n falls is divided by √n.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean
from typing import NamedTuple

import numpy as np

from rig.analysis.distributions import chi2_tail, coverage_factor
from rig.analysis.plain_data import Record
from rig.analysis.result import Deviation, DropResult, Measured
from rig.arrays import Array
from rig.measurands import averaged
from rig.predictions import coefficient_slopes, predicted_run
from rig.protocol.protocol import GUESSED, Condition, Protocol

_ROUNDING = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference(Measured):
    """A mean less the model's prediction under a condition, m or m/s.

    Its standard uncertainty includes the scatter of falls.

    Attributes
    ----------
    n
        Drops in the mean.
    """

    MEMBERS = "*condition difference=value n u normalized_error chi2 p"

    condition: Condition
    n: int

    @property
    def chi2(self) -> float:
        """χ² of this condition alone, with 1 degree of freedom."""
        return (self.value / self.u) ** 2

    @property
    def p(self) -> float:
        """Probability of a χ² at least as large by chance."""
        return chi2_tail(self.chi2, 1)


@dataclass(frozen=True, slots=True)
class Comparison(Record):
    """Comparison of a measurand with the model.

    Attributes
    ----------
    quantity
        Its name in JSON.
    chi2
        χ² of all conditions together, with their covariance.
    """

    MEMBERS = "quantity chi2 degrees p inclines=differences"

    quantity: str
    chi2: float
    differences: tuple[Difference, ...]

    @property
    def degrees(self) -> int:
        """Degrees of freedom of χ²."""
        return len(self.differences)

    @property
    def p(self) -> float:
        """Probability of a χ² at least as large by chance."""
        return chi2_tail(self.chi2, self.degrees)


def compare(protocol: Protocol, cases: Sequence[Sequence[DropResult]]) -> tuple[Comparison, ...]:
    """Compare means with the protocol's model, all conditions at once.

    Means of different conditions share the rig's errors, and predictions share the model's
    coefficients. The covariance of χ² includes both, so that a wrong β counts once and not nine
    times. Conditions outside the model's domain are left out.

    Parameters
    ----------
    cases
        Drops of each condition, see `rig.analysis.summary.by_case`.

    Returns
    -------
    tuple of Comparison
        A comparison for each measurand with a prediction, unless the difference is exact.
    """
    models = [predicted_run(protocol, runs[0].run) for runs in cases]
    slopes = [coefficient_slopes(protocol, runs[0].run) for runs in cases]
    comparisons = []
    for name in (row.name for row in averaged()):
        lines = [
            _Line(
                protocol.condition(runs[0].run),
                np.array([run.quantities[name].value - model[name].value for run in runs]),
                [_deviation(run.quantities[name]) for run in runs],
                runs[0].quantities[name].u,
                slope.get(name, {}),
            )
            for runs, model, slope in zip(cases, models, slopes, strict=True)
            if name in model and all(name in run.quantities for run in runs)
        ]
        comparisons += [_compare(name, lines)] if lines else []
    return tuple(comparison for comparison in comparisons if comparison.differences)


def _deviation(measured: Measured) -> Deviation:
    """Return the deviation of a value; without a fit, its uncertainty counts as its own."""
    return measured.deviation or Deviation(measured.u**2, measured.degrees, (0.0,), (0.0,))


class _Line(NamedTuple):
    """Values less their prediction under a condition, and its derivatives by the coefficients."""

    condition: Condition
    off: Array
    deviations: Sequence[Deviation]
    u: float
    slopes: Mapping[str, float]


def _compare(name: str, lines: Sequence[_Line]) -> Comparison:
    names = {key: None for line in lines for key in line.slopes}
    slopes = np.array([[line.slopes.get(key, 0.0) for key in names] for line in lines])
    size = np.sum(slopes**2, axis=1) + [line.u**2 for line in lines]
    covariance = _covariance(lines) + slopes @ slopes.T
    places = np.flatnonzero(covariance.diagonal() > _ROUNDING * size)
    covariance = covariance[np.ix_(places, places)]
    lines = [lines[place] for place in places.tolist()]
    off = np.array([float(line.off.mean()) for line in lines])
    differences = [
        Difference(value, math.sqrt(u2), condition=line.condition, n=line.off.size)
        for line, value, u2 in zip(lines, off.tolist(), covariance.diagonal().tolist(), strict=True)
    ]
    return Comparison(name, float(off @ np.linalg.solve(covariance, off)), tuple(differences))


def _covariance(lines: Sequence[_Line]) -> Array:
    """Return the covariance of the means, by their own falls and by shared errors.

    The predicted scatter of falls comes from their impulses. The observed scatter within
    conditions rescales it; the prediction then counts as a scale with `GUESSED` degrees of freedom.
    """
    drops = [drop for line in lines for drop in line.deviations]
    alike = len({len(drop.plus) for drop in drops}) == 1
    own, plus, minus, seen, seen_degrees = [], [], [], 0.0, 0
    for line in lines:
        deviations = line.deviations if alike else [*map(_by_size, line.deviations)]
        gains, losses = (np.array([drop[place] for drop in deviations]) for place in (2, 3))
        plus.append(gains.mean(axis=0))
        minus.append(losses.mean(axis=0))
        single, n = fmean(drop.own for drop in deviations), len(deviations)
        own.append(single / n)
        # Chains that change places bring their own rods, so these errors vary within a condition.
        foretold = float(gains.var(axis=0).sum() - losses.var(axis=0).sum()) * n + single * (n - 1)
        if foretold > 0.0:
            seen += float(line.off.var()) * n * (n - 1) / foretold
            seen_degrees += n - 1
    factor = (GUESSED + seen) / (GUESSED + seen_degrees)
    unsure = max(1.0 / drop.degrees for drop in drops)
    unsure += seen_degrees / (GUESSED + seen_degrees) ** 2
    degrees = max(1.0, 1.0 / unsure) if unsure else math.inf
    # Widen a scale with few degrees of freedom to its expanded uncertainty.
    factor *= (coverage_factor(degrees) / coverage_factor(math.inf)) ** 2
    gains, losses = np.array(plus), np.array(minus)
    covariance: Array = np.diag(factor * np.array(own)) + gains @ gains.T - losses @ losses.T
    return covariance


def _by_size(deviation: Deviation) -> Deviation:
    """Return a deviation with a fully common part, as for drops fitted alone no more is known."""
    size = float(np.dot(deviation.plus, deviation.plus) - np.dot(deviation.minus, deviation.minus))
    return deviation._replace(plus=(math.sqrt(max(0.0, size)),), minus=(0.0,))
