"""Whether results agree with the model: the one comparison behind every Eₙ, χ² and p.

What is measured less what is predicted is a measurand of its own. Besides what measuring leaves
open, and what the model's coefficients do, its uncertainty holds what single falls do otherwise
than their mean: one fall is off by all of it, the mean of n falls by its share of √n.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import fmean
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.analysis.distributions import chi2_tail, coverage_factor
from rig.analysis.plain_data import attributes, plain
from rig.analysis.result import Deviation, Measured
from rig.measurands import averaged
from rig.predictions import coefficient_slopes, predicted_run
from rig.protocol.protocol import GUESSED

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rig.analysis.result import DropResult
    from rig.arrays import Array
    from rig.protocol.protocol import Condition, Protocol


_ROUNDING = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference(Measured):
    """A mean less the model, under one condition, m or m/s.

    Its standard uncertainty holds the scatter of falls.

    Attributes
    ----------
    n
        Drops in the mean.
    """

    condition: Condition
    n: int

    @property
    def chi2(self) -> float:
        """Of this condition alone."""
        return (self.value / self.u) ** 2

    @property
    def p(self) -> float:
        """How often chance alone would make χ² as large."""
        return chi2_tail(self.chi2, 1)

    def json(self) -> dict[str, Any]:
        """One of ``inclines``."""
        names = ("n", "u", "normalized_error", "chi2", "p")
        return {**self.condition.json(), "difference": self.value, **attributes(self, *names)}


@dataclass(frozen=True, slots=True)
class Comparison:
    """One measurand against the model.

    Attributes
    ----------
    quantity
        Its name in JSON.
    chi2
        Of all conditions together, with what they have in common.
    """

    quantity: str
    chi2: float
    differences: tuple[Difference, ...]

    @property
    def degrees(self) -> int:
        """Degrees of freedom of χ²."""
        return len(self.differences)

    @property
    def p(self) -> float:
        """How often chance alone would make χ² as large."""
        return chi2_tail(self.chi2, self.degrees)

    def json(self) -> dict[str, Any]:
        """One of ``comparison``."""
        fields = attributes(self, "quantity", "chi2", "degrees", "p")
        return fields | {"inclines": plain(self.differences)}


def compare(protocol: Protocol, cases: Sequence[Sequence[DropResult]]) -> tuple[Comparison, ...]:
    """Compare means with the protocol's model, all conditions at once.

    Means of different conditions share the rig's errors, and predictions the model's coefficients:
    both stand in the covariance with which χ² is made, so that one wrong β counts once and not nine
    times. What is outside the model's domain is left out.

    Parameters
    ----------
    cases
        Drops of one condition each, see `rig.analysis.summary.by_case`.

    Returns
    -------
    tuple of Comparison
        One a measurand that is measured and predicted, and may differ at all.
    """
    comparisons = []
    models = [predicted_run(protocol, runs[0].run) for runs in cases]
    slopes = [coefficient_slopes(protocol, runs[0].run) for runs in cases]
    for name in (row.name for row in averaged()):
        lines = [
            _Line(
                protocol.condition(runs[0].run),
                [run.quantities[name] for run in runs],
                model[name].value,
                slope.get(name, {}),
            )
            for runs, model, slope in zip(cases, models, slopes, strict=True)
            if name in model and all(name in run.quantities for run in runs)
        ]
        comparison = _compare(name, lines) if lines else None
        if comparison is not None:
            comparisons.append(comparison)
    return tuple(comparisons)


@dataclass(frozen=True, slots=True)
class _Line:
    """Values of one condition, and its prediction with what coefficients move it by."""

    condition: Condition
    values: Sequence[Measured]
    predicted: float
    slopes: Mapping[str, float]

    @property
    def difference(self) -> float:
        return fmean(measured.value for measured in self.values) - self.predicted

    @property
    def deviations(self) -> list[Deviation]:
        """Of each value; of what no fit has made its own uncertainty is all that is known."""
        return [
            measured.deviation or Deviation(measured.u**2, measured.degrees, (0.0,), (0.0,))
            for measured in self.values
        ]


def _compare(name: str, lines: Sequence[_Line]) -> Comparison | None:
    names = list(dict.fromkeys(key for line in lines for key in line.slopes))
    slopes = np.array([[line.slopes.get(key, 0.0) for key in names] for line in lines])
    own, common = _parts(lines)
    covariance = np.diag(own) + common + slopes @ slopes.T
    size = np.diag(slopes @ slopes.T) + [line.values[0].u ** 2 for line in lines]
    places = np.flatnonzero(np.diag(covariance) > _ROUNDING * size).tolist()
    if not places:
        return None
    covariance = covariance[np.ix_(places, places)]
    differences = tuple(
        Difference(line.difference, math.sqrt(u2), condition=line.condition, n=len(line.values))
        for line, u2 in zip((lines[n] for n in places), np.diag(covariance).tolist(), strict=True)
    )
    off = np.array([difference.value for difference in differences])
    return Comparison(name, float(off @ np.linalg.solve(covariance, off)), differences)


def _parts(lines: Sequence[_Line]) -> tuple[Array, Array]:
    """Variance of each mean by its own falls, and covariance by what all drops have in common.

    How far falls scatter is foretold by each one's impulses. How far those of one condition really
    do is a second opinion, beside which the first one counts as a guessed scale does.
    """
    own, plus, minus = [], [], []
    seen, seen_degrees, degrees = 0.0, 0, math.inf
    alike = len({len(drop.plus) for line in lines for drop in line.deviations}) == 1
    for line in lines:
        drops = line.deviations if alike else [_by_size(drop) for drop in line.deviations]
        gains, losses = (np.array([drop[place] for drop in drops]) for place in (2, 3))
        plus.append(gains.mean(axis=0))
        minus.append(losses.mean(axis=0))
        single = fmean(drop.own for drop in drops)
        own.append(single / len(drops))
        degrees = min(degrees, *(drop.degrees for drop in drops))
        # Chains that change places bring their own rods: those differ within a condition.
        foretold = float(gains.var(axis=0).sum() - losses.var(axis=0).sum()) * len(drops)
        foretold += single * (len(drops) - 1)
        if foretold > 0.0:
            values = np.array([drop.value for drop in line.values])
            seen += float(values.var()) * len(drops) * (len(drops) - 1) / foretold
            seen_degrees += len(drops) - 1
    factor = (GUESSED + seen) / (GUESSED + seen_degrees)
    unsure = 1.0 / degrees + seen_degrees / (GUESSED + seen_degrees) ** 2
    degrees_together = 1.0 / unsure if unsure else math.inf
    # A scale that is known from few counts for as much as its expanded uncertainty says.
    factor *= (coverage_factor(max(1.0, degrees_together)) / coverage_factor(math.inf)) ** 2
    gains, losses = np.array(plus), np.array(minus)
    return factor * np.array(own), gains @ gains.T - losses @ losses.T


def _by_size(deviation: Deviation) -> Deviation:
    """Take what drops share as fully common: of drops by themselves no more is known."""
    size = float(np.dot(deviation.plus, deviation.plus) - np.dot(deviation.minus, deviation.minus))
    return deviation._replace(plus=(math.sqrt(max(0.0, size)),), minus=(0.0,))
