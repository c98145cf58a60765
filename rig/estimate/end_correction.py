"""Is Eq. 11's end correction needed: γ left open, by Eq. 10, and without."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rig.analysis.distributions import chi2_tail
from rig.analysis.result import Measured
from rig.estimate.coefficients import nuisances
from rig.estimate.hypotheses import END, ended, one_alpha
from rig.estimate.hypothesis_fit import fit
from rig.model.rods import rod_impacts

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rig.estimate.coefficients import CoefficientProblem
    from rig.estimate.quadratic_forms import QuadraticForm
    from rig.protocol.protocol import Protocol

    Array = NDArray[np.float64]

STRONG = 10.0
"""ΔAIC from which the worse model has essentially no support (Burnham and Anderson 2002)."""
_TELLS = 0.5  # standard uncertainty of γ over Eq. 10's, above which the edges do not tell it


def end_correction(protocol: Protocol, found: CoefficientProblem) -> dict[str, Any] | None:
    """Compare the three, with one α for each incline, so that Eqs. 8 to 13 are not at stake.

    Returns
    -------
    dict or None
        ``scale``: γ over that of Eq. 10; ``gamma``, where it is the same for all rods; χ² and AIC
        of each hypothesis less those of the best; ``p_without`` and ``p_eq10`` by the likelihood
        ratio (one degree of freedom); ``needed``; ``sentence``. `None` where γ is given as 0.
    """

    def gammas(form: QuadraticForm) -> Array:
        assert protocol.surface is not None
        return np.array([one.gamma for one in rod_impacts(protocol.surface, form.chain, 0.0)])

    by_eq10 = {float(gamma) for form in found.forms for gamma in gammas(form)}
    if by_eq10 == {0.0}:
        return None
    cases = one_alpha(found.forms, lambda one: tuple(protocol.case(one.run).values()))
    inclines = nuisances(protocol, found, cases)
    outcomes = {
        "open": fit(found.forms, ended(inclines, gammas, None)),
        "eq10": fit(found.forms, inclines),
        "without": fit(found.forms, ended(inclines, gammas, 0.0)),
    }
    chi2 = {name: one.chi2 for name, one in outcomes.items()}
    aic = {name: one + (2.0 if name == "open" else 0.0) for name, one in chi2.items()}
    scale = Measured(*outcomes["open"][END])
    said: dict[str, Any] = {
        "scale": scale.json(),
        "delta_chi2": {name: one - min(chi2.values()) for name, one in chi2.items()},
        "delta_aic": {name: one - min(aic.values()) for name, one in aic.items()},
        "p_without": chi2_tail(chi2["without"] - chi2["open"], 1),
        "p_eq10": chi2_tail(chi2["eq10"] - chi2["open"], 1),
    }
    if len(by_eq10) == 1:
        (gamma,) = by_eq10
        said["gamma_eq10"] = gamma
        said["gamma"] = Measured(gamma * scale.value, gamma * scale.u).json()
    worse = aic["without"] - min(aic["open"], aic["eq10"])
    told = scale.u <= _TELLS
    said["needed"] = bool(worse > 0.0) if told else None
    said["sentence"] = _sentence(scale, worse, said["p_eq10"], told=told)
    return said


def _sentence(scale: Measured, worse: float, p_eq10: float, *, told: bool) -> str:
    size = f"γ is {scale.value:.3f} ± {scale.expanded:.3f} (95 %) times that of Eq. 10"
    if not told:
        return f"The edges do not tell whether the end correction is needed: {size}."
    agree = f"p {p_eq10:.2g} for Eq. 10"
    if worse > STRONG:
        return (
            f"The end correction is needed: without it AIC is {worse:.0f} worse; {size}, {agree}."
        )
    if worse > 0.0:
        return (
            f"The edges lean towards the end correction: without it AIC is {worse:.2g} worse; "
            f"{size}, {agree}."
        )
    return f"The end correction is not needed: without it AIC is {-worse:.2g} better; {size}."
