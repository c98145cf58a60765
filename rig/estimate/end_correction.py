"""Is Eq. 11's end correction needed: γ left open, by Eq. 10, and without."""

from typing import Any, NamedTuple

from rig.analysis.distributions import chi2_tail
from rig.analysis.result import Measured
from rig.estimate.coefficients import FOUND, CoefficientProblem
from rig.estimate.hypotheses import END, one_alpha, with_end_correction, with_nuisances
from rig.estimate.hypothesis_fit import fit
from rig.model.impact import impact_on
from rig.plain_data import attributes
from rig.protocol.protocol import Protocol
from rig.reasons import make_reason

STRONG = 10.0
"""ΔAIC from which the worse model has essentially no support (Burnham and Anderson 2002)."""


class EndCorrection(NamedTuple):
    """Three hypotheses on γ, each with one α a condition.

    Attributes
    ----------
    scale
        γ over that of Eq. 10, where it is open.
    chi2
        By hypothesis: ``open``, ``eq10`` and ``without``.
    """

    scale: Measured
    chi2: dict[str, float]

    @property
    def aic(self) -> dict[str, float]:
        """Akaike's criterion of each; γ is one parameter more where it is open."""
        return self.chi2 | {"open": self.chi2["open"] + 2.0}

    @property
    def worse(self) -> float:
        """By how much AIC is larger without the correction than with the better of both."""
        return self.aic["without"] - min(self.aic["open"], self.aic["eq10"])

    @property
    def p(self) -> dict[str, float]:
        """Likelihood ratio of each hypothesis against an open γ."""
        return {name: chi2_tail(chi2 - self.chi2["open"], 1) for name, chi2 in self.chi2.items()}

    @property
    def is_needed(self) -> bool | None:
        """Whether edges want it; `None` where they do not tell."""
        return self.worse > 0.0 if self.scale.u <= FOUND else None

    @property
    def sentence(self) -> str:
        """What follows."""
        needed = "end_needed" if self.worse > STRONG else "end_likely"
        told = needed if self.worse > 0.0 else "end_unneeded"
        values = {"scale": self.scale.value, "U95": self.scale.expanded, "aic": abs(self.worse)}
        code = "end_untold" if self.is_needed is None else told
        return f"{make_reason(code, p=self.p['eq10'], **values)}."

    def json(self) -> dict[str, Any]:
        """``end_correction``."""
        record: dict[str, Any] = {
            "scale": self.scale.json(),
            "delta_aic": {name: aic - min(self.aic.values()) for name, aic in self.aic.items()},
            "p_without": self.p["without"],
            "p_eq10": self.p["eq10"],
        }
        return record | attributes(self, "needed=is_needed", "sentence")


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
    if not any(gammas.values()):
        return None
    cases = one_alpha(problem.forms, lambda form: protocol.condition(form.run))
    inclines = with_nuisances(cases, problem.inclines, protocol)
    fits = {
        name: fit(problem.forms, with_end_correction(inclines, gammas, scale))
        for name, scale in {"open": None, "eq10": 1.0, "without": 0.0}.items()
    }
    return EndCorrection(fits["open"][END], {name: fits[name].chi2 for name in fits})
