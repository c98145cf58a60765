"""Everything that a session says of the impacts, as plain data."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rig.analysis.distributions import chi2_tail
from rig.analysis.result import GOOD, Measured
from rig.analysis.unknowns import SharedUnknowns
from rig.errors import InputError
from rig.estimate import coefficients as of
from rig.estimate.agreement import agreement
from rig.estimate.curves import drop_curves
from rig.estimate.end_correction import end_correction
from rig.estimate.hypotheses import AIR, one_alpha
from rig.estimate.hypothesis_fit import fit
from rig.estimate.posterior import posterior
from rig.estimate.quadratic_forms import merged, quadratic_form
from rig.estimate.rods import impulses
from rig.sections import Sections
from rig.threads import one_thread

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.analysis.session import Analysis
    from rig.estimate.coefficients import CoefficientProblem
    from rig.estimate.hypothesis_fit import HypothesisFit
    from rig.estimate.quadratic_forms import QuadraticForm
    from rig.protocol.protocol import Protocol, Run


@one_thread
def estimate(protocol: Protocol, analysis: Analysis) -> dict[str, Any]:
    """Estimate what the impacts of a session have in common.

    Parameters
    ----------
    protocol
        The session's, with a surface.
    analysis
        Of the session.

    Returns
    -------
    dict
        What ``rig estimate --json`` prints. A section that could not be worked out is missing, and
        ``failed`` has a sentence on it.

    Raises
    ------
    InputError
        Where no chain strikes anything, or no drop is good.
    """
    if protocol.surface is None:
        raise InputError(
            "nothing strikes anything in this session, so there are no impacts to estimate",
            "rig analyze SESSION gives the acceleration of free fall",
        )
    good = {(one.run.number, one.attempt): one.run for one in analysis.runs if one.verdict in GOOD}
    drops = {key: analysis.adjusted[key] for key in good if key in analysis.adjusted}
    if not drops:
        raise InputError("no good drop in this session", "rig analyze SESSION says why")
    shared = (
        analysis.joint.shared if analysis.joint else SharedUnknowns(d.model for d in drops.values())
    )
    forms = [quadratic_form(good[key], drop, shared) for key, drop in drops.items()]
    like = merged(forms)
    said: dict[str, Any] = {"drops": len(forms), "edges": sum(one.edges for one in forms)}
    sections = Sections()
    found, outcome = None, None
    with sections.alone("The coefficients"):
        found = of.coefficient_problem(protocol, like)
        said["left_out"] = list(found.left_out)
        if found.forms:
            outcome = of.best(protocol, found)
            said |= _coefficients(protocol, found, outcome)
    with sections.alone("The end correction"):
        if found is not None and found.forms:
            said["end_correction"] = end_correction(protocol, found)
    with sections.alone("The best single α"):
        said |= _alphas(protocol, found, outcome, forms, like)
    with sections.alone("The speed gained from each rod"):
        said["impulses"] = impulses(protocol, like)
    with sections.alone("The comparison with the model"):
        said["comparison"] = agreement(protocol, analysis.runs)
    with sections.alone("The curves"):
        first = {_case(protocol, good[key]): key for key in reversed(drops)}
        said["curves"] = [
            drop_curves(protocol, good[key], drops[key], analysis.joint)
            for _, key in sorted(first.items())
        ]
    if sections.failed:
        said["failed"] = [*sections.failed.values()]
    return said


def _case(protocol: Protocol, run: Run) -> tuple[object, ...]:
    return tuple(protocol.case(run).values())


def _coefficients(
    protocol: Protocol, found: CoefficientProblem, outcome: HypothesisFit
) -> dict[str, Any]:
    """Least squares and posterior, with correlations and nuisances."""
    contact = []
    for incline in found.inclines:
        height = Measured(*outcome[f"contact {incline:g}"])
        contact.append(
            {
                "incline_deg": incline,
                "height_m": height.json(),
                "identified": height.u < of.FOUND * of.CONTACT_U,
            }
        )
    drag = Measured(*outcome[AIR]).json() if AIR in outcome else None
    said = _told(protocol, found, outcome) if found.stated else {"parameters": []}
    return said | {"contact": contact, "drag_per_m": drag, "edges_chi2": outcome.chi2}


def _told(protocol: Protocol, found: CoefficientProblem, outcome: HypothesisFit) -> dict[str, Any]:
    """What is said of the coefficients that are fitted."""
    names = list(found.stated)
    bayes = posterior(protocol, found, outcome)
    parameters = []
    for name in names:
        mean, sd = bayes.moments(name)
        low, high = bayes.interval(name)
        stated = found.stated[name]
        parameters.append(
            {
                "name": name,
                "identified": name not in found.held,
                "least_squares": Measured(*outcome[name]).json(),
                "posterior": {"value": mean, "u": sd, "low": low, "high": high},
                "stated": {"value": stated.value, "u": stated.u},
            }
        )
    return {
        "parameters": parameters,
        "correlation": {"names": names, "matrix": of.correlation(outcome, names)},
        "posterior": {
            "nodes": bayes.weights.size,
            "names": list(bayes.names),
            "weights": bayes.weights.tolist(),
            "means": bayes.means.tolist(),
            "sds": bayes.sds.tolist(),
        },
    }


def _alphas(
    protocol: Protocol,
    found: CoefficientProblem | None,
    outcome: HypothesisFit | None,
    forms: Sequence[QuadraticForm],
    like: Sequence[QuadraticForm],
) -> dict[str, Any]:
    """The best single α of every run and case, and whether they agree.

    A case is an incline, or an incline and a striking chain where chains are unlike.
    """

    def case(one: QuadraticForm) -> tuple[object, ...]:
        return _case(protocol, one.run)

    by_run = fit(forms, one_alpha(forms, lambda one: one.run.number))
    by_case = fit(like, one_alpha(like, case))
    model = {}
    if found is not None and outcome is not None:
        alphas = _model_alphas(protocol, found, outcome)
        model = {case(one): alpha for one, alpha in zip(found.forms, alphas, strict=True)}
    cases = []
    for key, one in sorted({case(one): one for one in reversed(like)}.items()):
        line: dict[str, Any] = {
            **protocol.case(one.run),
            "n": sum(case(other) == key for other in forms),
            "alpha": Measured(*by_case[f"α {key}"]).json(),
        }
        cases.append(line | ({"model": model[key]} if key in model else {}))
    runs = []
    for one in forms:
        alpha = Measured(*by_run[f"α {one.run.number}"])
        line = {
            "run": one.run.number,
            "incline_deg": one.run.incline_deg,
            "impact_chain": one.run.impact,
            "alpha": alpha.json(),
        }
        if case(one) in model:
            line["residual"] = (alpha.value - model[case(one)]) / alpha.u
        runs.append(line)
    tests = {}
    if len(forms) > len(cases):
        tests["runs_share_alpha"] = _test(by_case.chi2 - by_run.chi2, len(forms) - len(cases))
    if found is not None and outcome is not None and found.parameters and not found.held:
        degrees = len(set(map(case, found.forms))) - len(found.parameters)
        if degrees > 0:
            # Without the nuisances, so that both suppose the same but for α.
            open_ = fit(found.forms, one_alpha(found.forms, case))
            plain = fit(found.forms, of.model(protocol, found.parameters))
            tests["model"] = _test(plain.chi2 - open_.chi2, degrees)
    return {"alpha": {"inclines": cases, "runs": runs}, "tests": tests}


def _test(chi2: float, degrees: int) -> dict[str, Any]:
    chi2 = max(0.0, chi2)
    return {"chi2": chi2, "degrees": degrees, "p": chi2_tail(chi2, degrees)}


def _model_alphas(
    protocol: Protocol, found: CoefficientProblem, outcome: HypothesisFit
) -> list[float]:
    """α of the model with the fitted coefficients, of each form."""
    model = of.model(protocol, found.parameters)
    values = outcome.values[: len(found.parameters)]
    return [float(model.targets(one, values)[0][: one.alphas.size].mean()) for one in found.forms]
