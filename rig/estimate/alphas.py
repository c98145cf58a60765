"""The best single α of every run and condition, and whether they agree."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from rig.analysis.result import Measured
from rig.estimate.coefficients import CoefficientProblem
from rig.estimate.hypotheses import by_model, one_alpha, with_nuisances
from rig.estimate.hypothesis_fit import Hypothesis, HypothesisFit, LikelihoodRatio, fit
from rig.estimate.quadratic_forms import QuadraticForm
from rig.plain_data import attributes, plain
from rig.protocol.protocol import Condition, Protocol, Run


class ConditionAlpha(NamedTuple):
    """The best single α under a condition.

    Attributes
    ----------
    n
        Drops it rests on.
    model
        By Eqs. 8 to 13 with the fitted coefficients; `None` where they say nothing of it.
    """

    condition: Condition
    n: int
    alpha: Measured
    model: float | None

    def json(self) -> dict[str, Any]:
        """One of ``inclines``."""
        return attributes(self, "*condition", "n", "alpha", "model?")


class RunAlpha(NamedTuple):
    """The best single α of one run; `model` as in `ConditionAlpha`."""

    run: Run
    alpha: Measured
    model: float | None

    @property
    def residual(self) -> float | None:
        """Less that of the model, in standard uncertainties."""
        return None if self.model is None else (self.alpha.value - self.model) / self.alpha.u

    @property
    def normalized_error(self) -> float | None:
        """The same in expanded uncertainties."""
        return None if self.residual is None else self.residual / 2.0

    def json(self) -> dict[str, Any]:
        """One of ``runs``."""
        return attributes(self, "*run", "alpha", "residual?")


class SingleAlphas(NamedTuple):
    """The best single α's.

    Attributes
    ----------
    inclines, runs
        Of each condition and of each run.
    tests
        ``runs_share_alpha``: one α for the runs of a condition against one for each; ``model``:
        Eqs. 8 to 13 with the fitted coefficients against one α a condition. Neither is there where
        it leaves no degree of freedom.
    """

    inclines: tuple[ConditionAlpha, ...]
    runs: tuple[RunAlpha, ...]
    tests: Mapping[str, LikelihoodRatio]

    def json(self) -> dict[str, Any]:
        """``alpha`` and ``tests``."""
        return {"alpha": attributes(self, "inclines", "runs"), "tests": plain(self.tests)}


def single_alphas(
    protocol: Protocol,
    problem: CoefficientProblem | None,
    outcome: HypothesisFit | None,
    forms: Sequence[QuadraticForm],
    groups: Sequence[QuadraticForm],
) -> SingleAlphas:
    """Fit one α to each run, and one to each condition.

    Parameters
    ----------
    problem, outcome
        The coefficients and their fit, where there is one.
    forms, groups
        Of each drop, and of like drops merged.
    """

    def case(form: QuadraticForm) -> Condition:
        return protocol.condition(form.run)

    def in_air(supposed: Hypothesis) -> Hypothesis:
        return with_nuisances(supposed, (), protocol)

    by_run = fit(forms, in_air(one_alpha(forms, lambda form: form.run.number)))
    by_case = fit(groups, in_air(one_alpha(groups, case)))
    counts = Counter(map(case, forms))
    model: dict[Condition, float] = {}
    tests: dict[str, LikelihoodRatio] = {}
    if len(forms) > len(counts):
        tests["runs_share_alpha"] = by_case.against(by_run)
    if problem is not None and outcome is not None:
        supposed = by_model(protocol, problem.parameters)
        values = outcome.values[: len(problem.parameters)]
        model = {case(form): float(supposed.alphas(form, values)[0]) for form in problem.forms}
        if len(model) > len(problem.parameters) > len(problem.held) == 0:
            # With the contact where it is, so that both suppose the same but for α.
            open_ = fit(problem.forms, in_air(one_alpha(problem.forms, case)))
            tests["model"] = fit(problem.forms, in_air(supposed)).against(open_)
    return SingleAlphas(
        tuple(
            ConditionAlpha(key, counts[key], by_case[f"α {key}"], model.get(key))
            for key in sorted(counts)
        ),
        tuple(
            RunAlpha(form.run, by_run[f"α {form.run.number}"], model.get(case(form)))
            for form in forms
        ),
        tests,
    )
