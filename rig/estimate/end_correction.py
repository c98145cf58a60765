"""Is Eq. 11's end correction needed: γ left open, by Eq. 10, and without."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rig.analysis.air import prior_air
from rig.analysis.distributions import chi2_tail
from rig.analysis.plain_data import attributes
from rig.analysis.result import Measured
from rig.estimate.hypotheses import END, one_alpha, with_end_correction, with_nuisances
from rig.estimate.hypothesis_fit import fit
from rig.model.impact import impact_on

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rig.estimate.coefficients import CoefficientProblem
    from rig.protocol.protocol import Protocol

STRONG = 10.0
"""ΔAIC from which the worse model has essentially no support (Burnham and Anderson 2002)."""
_TELLS = 0.5  # standard uncertainty of γ over Eq. 10's, above which the edges do not tell it


@dataclass(frozen=True, slots=True)
class EndCorrection:
    """Three hypotheses on γ, each with one α a condition.

    Attributes
    ----------
    scale
        γ over that of Eq. 10, where it is open.
    chi2
        By hypothesis: ``open``, ``eq10`` and ``without``.
    gamma_eq10
        γ by Eq. 10 where it is the same for all chains.
    """

    scale: Measured
    chi2: Mapping[str, float]
    gamma_eq10: float | None

    @property
    def aic(self) -> dict[str, float]:
        """Akaike's criterion of each; γ is one parameter more where it is open."""
        return {name: chi2 + (2.0 if name == "open" else 0.0) for name, chi2 in self.chi2.items()}

    @property
    def _worse(self) -> float:
        """By how much AIC is larger without the correction than with the better of both."""
        return self.aic["without"] - min(self.aic["open"], self.aic["eq10"])

    @property
    def is_needed(self) -> bool | None:
        """Whether edges want it; `None` where they do not tell."""
        return self._worse > 0.0 if self.scale.u <= _TELLS else None

    def _p(self, name: str) -> float:
        """Likelihood ratio of a hypothesis against an open γ."""
        return chi2_tail(self.chi2[name] - self.chi2["open"], 1)

    @property
    def sentence(self) -> str:
        """What follows."""
        scale, worse = self.scale, self._worse
        size = f"γ is {scale.value:.3f} ± {scale.expanded:.3f} (95 %) times that of Eq. 10"
        if self.is_needed is None:
            return f"The edges do not tell whether the end correction is needed: {size}."
        if worse <= 0.0:
            without = f"without it AIC is {-worse:.2g} better"
            return f"The end correction is not needed: {without}; {size}."
        needed, by = (
            ("The end correction is needed", f"{worse:.0f}")
            if worse > STRONG
            else ("The edges lean towards the end correction", f"{worse:.2g}")
        )
        agree = f"p {self._p('eq10'):.2g} for Eq. 10"
        return f"{needed}: without it AIC is {by} worse; {size}, {agree}."

    def json(self) -> dict[str, Any]:
        """``end_correction``."""
        record: dict[str, Any] = {
            "scale": self.scale.json(),
            "delta_chi2": _above_least(self.chi2),
            "delta_aic": _above_least(self.aic),
            "p_without": self._p("without"),
            "p_eq10": self._p("eq10"),
        }
        if (gamma := self.gamma_eq10) is not None:  # the same for all chains
            own = Measured(gamma * self.scale.value, gamma * self.scale.u)
            record |= {"gamma_eq10": gamma, "gamma": own.json()}
        return record | {"needed": self.is_needed} | attributes(self, "sentence")


def _above_least(values: Mapping[str, float]) -> dict[str, float]:
    return {name: value - min(values.values()) for name, value in values.items()}


def end_correction(protocol: Protocol, problem: CoefficientProblem) -> EndCorrection | None:
    """Compare the three, with one α for each incline, so that Eqs. 8 to 13 are not at stake.

    Returns
    -------
    EndCorrection or None
        `None` where γ is given as 0.
    """
    assert protocol.surface is not None
    chains = dict.fromkeys(form.chain for form in problem.forms)
    gammas = {chain: impact_on(protocol.surface, chain, 0.0).gamma for chain in chains}
    if (by_eq10 := {*gammas.values()}) == {0.0}:
        return None
    cases = one_alpha(problem.forms, lambda form: protocol.condition(form.run))
    inclines = with_nuisances(cases, problem.inclines, prior_air(protocol))
    fits = {
        name: fit(problem.forms, with_end_correction(inclines, gammas, scale))
        for name, scale in {"open": None, "eq10": 1.0, "without": 0.0}.items()
    }
    same = by_eq10.pop() if len(by_eq10) == 1 else None
    chi2 = {name: outcome.chi2 for name, outcome in fits.items()}
    return EndCorrection(Measured(*fits["open"][END]), chi2, same)
