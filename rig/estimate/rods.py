"""The impulse of every rod, measured, beside Eq. 9."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rig.analysis.distributions import chi2_tail
from rig.analysis.result import Measured, normalized_error
from rig.analysis.summary import by_case
from rig.estimate.coefficients import CONTACT_U
from rig.estimate.hypotheses import each_rod, one_alpha, with_contact
from rig.estimate.hypothesis_fit import fit
from rig.units import Quantity

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from rig.estimate.hypothesis_fit import Hypothesis
    from rig.estimate.quadratic_forms import QuadraticForm
    from rig.protocol.protocol import Protocol

    Array = NDArray[np.float64]

RESOLVED = 0.5
"""U95 over the predicted impulse: rods known less well are taken together with the next ones."""


def impulses(protocol: Protocol, forms: Sequence[QuadraticForm]) -> dict[str, Any]:
    """Measure the speed that the chain gains from each rod, ΔV = J/M, at each incline.

    Neither Eq. 9 nor the scatter about it pulls at these numbers: the α of every rod is open, and
    the same for like drops. Where the gates cannot tell neighbours apart, their sum is given.

    Parameters
    ----------
    forms
        Of like drops, see `rig.estimate.quadratic_forms.merged`.

    Returns
    -------
    dict
        ``inclines``: for each, the best α, χ² of Eq. 9 with it against all rods open, and
        ``groups`` of rods (numbers from the bottom rod, 0) with ΔV as measured and by Eq. 9, m/s.
        ``sentence``: whether each rod was resolved.
    """
    lines = [_case(protocol, group) for group in by_case(protocol, forms, lambda one: one.run)]
    whole = [line for line in lines if line["resolved"] == line["rods"]]
    if len(whole) == len(lines):
        words = "The gates resolve the impulse of every rod at every incline."
    else:
        short = "; ".join(
            f"{line['incline_deg']:g}°: {line['resolved']} of {line['rods']}"
            for line in lines
            if line not in whole
        )
        words = (
            "The gates do not resolve every rod by itself; neighbours are taken together until "
            f"their sum is known to {RESOLVED:.0%} (95 %). Resolved alone at {short}."
        )
    return {"inclines": lines, "sentence": words}


def _case(protocol: Protocol, forms: Sequence[QuadraticForm]) -> dict[str, Any]:
    incline = forms[0].run.incline_deg

    def contact(hypothesis: Hypothesis) -> Hypothesis:
        return with_contact(hypothesis, [incline], (0.0, CONTACT_U))

    single = fit(forms, contact(one_alpha(forms, lambda _: "one")))
    each = fit(forms, contact(each_rod(forms, lambda _: "one")))
    rods = forms[0].alphas.size - 1
    weight = forms[0].ratios[:rods] * np.mean([form.arrivals[:rods] for form in forms], axis=0)
    gains = weight * each.values[:rods]
    covariance = each.covariance[:rods, :rods] * np.outer(weight, weight)
    alpha = single.values[0]
    model = weight * alpha
    spans = _groups(covariance, np.abs(model))
    groups = [_group(span, gains, covariance, model) for span in spans]
    chi2 = max(0.0, single.chi2 - each.chi2)
    return {
        **protocol.case(forms[0].run),
        "rods": rods,
        "resolved": sum(first == last for first, last in spans),
        "alpha": Measured(*single["α one"]).json(),
        "chi2": chi2,
        "degrees": rods - 1,
        "p": chi2_tail(chi2, rods - 1) if rods > 1 else None,
        "groups": groups,
    }


def _group(span: tuple[int, int], gains: Array, covariance: Array, model: Array) -> dict[str, Any]:
    part = slice(span[0], span[1] + 1)
    measured = Measured(float(gains[part].sum()), _sum_u(covariance, part))
    predicted = float(model[part].sum())
    return {
        "rods": [*span],
        "gain_m_s": measured.json(),
        "eq9_m_s": predicted,
        "normalized_error": normalized_error(measured, Quantity(predicted)),
    }


def _sum_u(covariance: Array, part: slice) -> float:
    """Standard uncertainty of a sum."""
    return float(np.sqrt(max(0.0, float(covariance[part, part].sum()))))


def _groups(covariance: Array, sizes: Array) -> list[tuple[int, int]]:
    """Neighbours whose sum is resolved, from the bottom; what is left joins the last ones."""
    found: list[tuple[int, int]] = []
    first = 0
    for last in range(sizes.size):
        part = slice(first, last + 1)
        u = Measured(0.0, _sum_u(covariance, part)).expanded
        if u <= RESOLVED * sizes[part].sum():
            found.append((first, last))
            first = last + 1
    if first < sizes.size:
        begin = found.pop()[0] if found else first
        found.append((begin, sizes.size - 1))
    return found
