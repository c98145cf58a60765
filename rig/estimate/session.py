"""Everything that a session says of the impacts, as plain data."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rig.analysis.result import GOOD, Measured
from rig.analysis.shared import Shared
from rig.errors import InputError
from rig.estimate import coefficients as of
from rig.estimate.agreement import agreement
from rig.estimate.curves import drop_curves
from rig.estimate.ends import end_correction
from rig.estimate.forms import form, merged
from rig.estimate.hypotheses import AIR, one_alpha
from rig.estimate.joint import fit
from rig.estimate.posterior import posterior
from rig.estimate.rods import impulses
from rig.estimate.tail import chi2_tail

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.analysis.session import Analysis
    from rig.estimate.coefficients import Scene
    from rig.estimate.forms import Form
    from rig.estimate.joint import Outcome
    from rig.protocol.scene import Protocol


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
        What ``rig estimate --json`` prints.

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
    shared = analysis.lesson.shared if analysis.lesson else Shared(d.model for d in drops.values())
    forms = [form(good[key], drop, shared) for key, drop in drops.items()]
    like = merged(forms)
    found = of.scene(protocol, like)
    said: dict[str, Any] = {"drops": len(forms), "edges": sum(one.edges for one in forms)}
    outcome = None
    if found.forms:
        outcome = of.best(protocol, found)
        said |= _coefficients(protocol, found, outcome)
        said["end_correction"] = end_correction(protocol, found)
    said["left_out"] = list(found.left_out)
    said |= _alphas(protocol, found, forms, like, outcome)
    said["impulses"] = impulses(like)
    said["comparison"] = agreement(protocol, analysis.runs)
    first = {good[key].incline_deg: key for key in reversed(drops)}
    said["curves"] = [
        drop_curves(protocol, good[key], drops[key], analysis.lesson)
        for _, key in sorted(first.items())
    ]
    return said


def _coefficients(protocol: Protocol, found: Scene, outcome: Outcome) -> dict[str, Any]:
    """Least squares and posterior, with correlations and nuisances."""
    bayes = posterior(protocol, found, outcome)
    names = list(found.stated)
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
        "contact": contact,
        "drag_per_m": drag,
        "edges_chi2": outcome.chi2,
    }


def _alphas(
    protocol: Protocol,
    found: Scene,
    forms: Sequence[Form],
    like: Sequence[Form],
    outcome: Outcome | None,
) -> dict[str, Any]:
    """The best single α of every run and incline, and whether they agree."""
    by_run = fit(forms, one_alpha(forms, lambda one: one.run.number))
    by_incline = fit(like, one_alpha(like, lambda one: one.run.incline_deg))
    model = _model_alphas(protocol, found, outcome)
    inclines = []
    for incline in sorted({one.run.incline_deg for one in like}):
        alpha = Measured(*by_incline[f"α {incline}"])
        line = {
            "incline_deg": incline,
            "n": sum(one.run.incline_deg == incline for one in forms),
            "alpha": alpha.json(),
        }
        inclines.append(line | ({"model": model[incline]} if incline in model else {}))
    runs = []
    for one in forms:
        alpha = Measured(*by_run[f"α {one.run.number}"])
        line = {
            "run": one.run.number,
            "incline_deg": one.run.incline_deg,
            "impact_chain": one.run.impact,
            "alpha": alpha.json(),
        }
        if one.run.incline_deg in model:
            line["residual"] = (alpha.value - model[one.run.incline_deg]) / alpha.u
        runs.append(line)
    said: dict[str, Any] = {"alpha": {"inclines": inclines, "runs": runs}}
    tests = {}
    if len(forms) > len(inclines):
        tests["runs_share_alpha"] = _test(by_incline.chi2 - by_run.chi2, len(forms) - len(inclines))
    free = sum(name not in found.held for name in found.stated)
    if outcome is not None and len(found.inclines) > free and not found.held:
        # Without the nuisances, so that both suppose the same but for α.
        only = [one for one in like if one.run.incline_deg in found.inclines]
        open_ = fit(only, one_alpha(only, lambda one: one.run.incline_deg))
        plain = fit(only, of.model(protocol, found, found.parameters))
        tests["model"] = _test(plain.chi2 - open_.chi2, len(found.inclines) - free)
    return said | {"tests": tests}


def _test(chi2: float, degrees: int) -> dict[str, Any]:
    chi2 = max(0.0, chi2)
    return {"chi2": chi2, "degrees": degrees, "p": chi2_tail(chi2, degrees)}


def _model_alphas(protocol: Protocol, found: Scene, outcome: Outcome | None) -> dict[float, float]:
    """α of the model with the fitted coefficients, by incline."""
    if outcome is None:
        return {}
    model = of.model(protocol, found, found.parameters)
    values = outcome.values[: len(found.parameters)]
    return {
        one.run.incline_deg: float(model.targets(one, values)[0][: one.alphas.size].mean())
        for one in found.forms
    }
