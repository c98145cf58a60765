"""The impulse of every rod, measured, beside Eq. 9."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from rig.analysis.averages import by_case
from rig.analysis.result import Measured
from rig.arrays import Array
from rig.estimate.hypotheses import one_alpha, open_alphas, with_nuisances
from rig.estimate.hypothesis_fit import LikelihoodRatio, fit
from rig.estimate.quadratic_forms import QuadraticForm
from rig.plain_data import attributes
from rig.protocol.protocol import Condition, Protocol
from rig.reasons import make_reason

RESOLVED = 0.5
"""U95 over the predicted impulse: rods known less well are taken together with the next ones."""


class Gain(NamedTuple):
    """Speed that the chain gains from neighbours which the gates tell apart from all others.

    Attributes
    ----------
    first, last
        Rods from the bottom rod, 0.
    measured
        ΔV = J/M, m/s.
    eq9_m_s
        By Eq. 9 with the best single α.
    """

    first: int
    last: int
    measured: Measured
    eq9_m_s: float

    @property
    def middle(self) -> float:
        """Between its rods, counted from 1."""
        return 1 + (self.first + self.last) / 2

    @property
    def normalized_error(self) -> float | None:
        """Of what was measured against Eq. 9."""
        return self.measured.less(Measured(self.eq9_m_s, 0.0)).normalized_error

    def json(self) -> dict[str, Any]:
        """One of ``groups``."""
        gain = attributes(self, "gain_m_s=measured", "eq9_m_s", "normalized_error")
        return {"rods": [self.first, self.last]} | gain


class Impulses(NamedTuple):
    """What each rod gave, under one condition.

    Attributes
    ----------
    rods
        How many strike.
    alpha
        The best single α.
    eq9
        χ² of Eq. 9 with it against all rods open.
    gains
        From the bottom rod up.
    """

    condition: Condition
    rods: int
    alpha: Measured
    eq9: LikelihoodRatio
    gains: tuple[Gain, ...]

    @property
    def resolved(self) -> int:
        """How many rods are told from both their neighbours."""
        return sum(gain.first == gain.last for gain in self.gains)

    def json(self) -> dict[str, Any]:
        """One of ``inclines``."""
        return attributes(self, "*condition", "rods", "resolved", "alpha", "*eq9", "groups=gains")


def impulses(protocol: Protocol, forms: Sequence[QuadraticForm]) -> tuple[Impulses, ...]:
    """Measure the speed that the chain gains from each rod, ΔV = J/M, at each incline.

    Neither Eq. 9 nor the scatter about it pulls at these numbers: the α of every rod is open, and
    the same for like drops. Where the gates cannot tell neighbours apart, their sum is given.

    Parameters
    ----------
    forms
        Of like drops, see `rig.estimate.quadratic_forms.merge_like`.

    Returns
    -------
    tuple of Impulses
        One a condition.
    """
    cases = by_case(protocol, forms).items()
    return tuple(_impulses(protocol, condition, group) for condition, group in cases)


def resolution(impulses_by_case: Sequence[Impulses]) -> str:
    """Say whether each rod was resolved."""
    short = [case for case in impulses_by_case if case.resolved < case.rods]
    if not short:
        return f"{make_reason('rods_resolved')}."
    inclines = (f"{at.condition.incline_deg:g}°: {at.resolved} of {at.rods}" for at in short)
    return f"{make_reason('rods_together', limit=100 * RESOLVED, inclines='; '.join(inclines))}."


def _impulses(protocol: Protocol, condition: Condition, forms: Sequence[QuadraticForm]) -> Impulses:
    single, open_fit = (
        fit(forms, with_nuisances(alphas, [condition.incline_deg], protocol))
        for alphas in (one_alpha(forms, lambda _: "one"), open_alphas(forms))
    )
    rods = forms[0].alphas.size - 1
    weight = forms[0].ratios[:rods] * np.mean([form.arrivals[:rods] for form in forms], axis=0)
    gains = weight * open_fit.values[:rods]
    covariance = open_fit.covariance[:rods, :rods] * np.outer(weight, weight)
    model = weight * single.values[0]
    groups = _gains(gains, covariance, model)
    return Impulses(condition, rods, single["α one"], single.against(open_fit), groups)


def _gains(gains: Array, covariance: Array, model: Array) -> tuple[Gain, ...]:
    """Sum neighbours from the bottom until resolved; what is left joins the last group."""

    def group_of(first: int, last: int) -> Gain:
        part = slice(first, last + 1)
        u = float(np.sqrt(max(0.0, float(covariance[part, part].sum()))))
        return Gain(first, last, Measured(float(gains[part].sum()), u), float(model[part].sum()))

    groups: list[Gain] = []
    first = 0
    for last in range(model.size):
        group = group_of(first, last)
        if group.measured.expanded <= RESOLVED * np.abs(model[first : last + 1]).sum():
            groups.append(group)
            first = last + 1
    if first < model.size:
        groups.append(group_of(groups.pop().first if groups else first, model.size - 1))
    return tuple(groups)
