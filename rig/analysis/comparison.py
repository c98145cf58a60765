"""Comparison of results with the model: the source of every Eₙ, χ² and p.

The difference of measured and predicted value is a measurand of its own. Its uncertainty includes
measurement, the model's coefficients, and the scatter of single falls about their mean, which for
the mean of n falls is divided by √n.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import compress
from statistics import fmean
from typing import NamedTuple

import numpy as np

from rig.analysis.averages import by_case
from rig.analysis.distributions import chi2_tail, coverage_factor
from rig.analysis.result import Deviation, DropResult, Measured
from rig.arrays import Array
from rig.measurands import averaged
from rig.plain_data import Record
from rig.predictions import coefficient_slopes, predicted_run
from rig.protocol.protocol import GUESSED, Condition, Protocol
from rig.units import Quantity


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


def compare(protocol: Protocol, results: Iterable[DropResult]) -> tuple[Comparison, ...]:
    """Compare means with the protocol's model, all conditions at once.

    Means of different conditions share the rig's errors, and predictions share the model's
    coefficients. The covariance of χ² includes both, so that a wrong β counts once and not nine
    times. Conditions outside the model's domain are left out.

    Returns
    -------
    tuple of Comparison
        A comparison for each measurand with a prediction, unless the difference is exact.
    """
    cases = by_case(protocol, results)
    models = [
        (predicted_run(protocol, run), coefficient_slopes(protocol, run))
        for run in (runs[0].run for runs in cases.values())
    ]
    comparisons = []
    for name in (row.name for row in averaged()):
        lines = [
            _Line(at, [run.quantities[name] for run in runs], model[name], slopes)
            for (at, runs), (model, slopes) in zip(cases.items(), models, strict=True)
            if name in model and all(name in run.quantities for run in runs)
        ]
        comparisons += [_compare(name, lines)] if lines else []
    return tuple(comparison for comparison in comparisons if comparison.differences)


class _Line(NamedTuple):
    """Values under a condition, their prediction, and how coefficients move all predictions."""

    condition: Condition
    values: Sequence[Measured]
    predicted: Quantity
    slopes: Mapping[str, Mapping[str, float]]

    @property
    def off(self) -> Array:
        """Each value less the prediction."""
        return np.array([measured.value - self.predicted.value for measured in self.values])

    @property
    def deviations(self) -> list[Deviation]:
        """Deviation of each value; without a fit, its uncertainty counts as its own."""
        return [
            measured.deviation or Deviation(measured.u**2, measured.degrees, (0.0,), (0.0,))
            for measured in self.values
        ]


def _compare(name: str, lines: Sequence[_Line]) -> Comparison:
    names = {key: None for line in lines for key in line.slopes}
    moves = np.array([[line.slopes.get(key, {}).get(name, 0.0) for key in names] for line in lines])
    size = np.sum(moves**2, axis=1) + [line.values[0].u ** 2 for line in lines]
    covariance = _covariance(lines) + moves @ moves.T
    # What is above zero by rounding alone is exact.
    inexact = covariance.diagonal() > math.sqrt(np.finfo(float).eps) * size
    covariance, lines = covariance[np.ix_(inexact, inexact)], [*compress(lines, inexact)]
    differences = tuple(
        Difference(float(line.off.mean()), u, condition=line.condition, n=len(line.values))
        for line, u in zip(lines, np.sqrt(covariance.diagonal()).tolist(), strict=True)
    )
    off = np.array([difference.value for difference in differences])
    return Comparison(name, float(off @ np.linalg.solve(covariance, off)), differences)


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
    return np.asarray(np.diag(factor * np.array(own)) + gains @ gains.T - losses @ losses.T)


def _by_size(deviation: Deviation) -> Deviation:
    """Return a deviation with a fully common part, as for drops fitted alone no more is known."""
    size = float(np.dot(deviation.plus, deviation.plus) - np.dot(deviation.minus, deviation.minus))
    return deviation._replace(plus=(math.sqrt(max(0.0, size)),), minus=(0.0,))
