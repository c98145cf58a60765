"""Everything that a session says of the impacts."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from rig.analysis.averages import by_case
from rig.analysis.comparison import Comparison, compare
from rig.analysis.result import GOOD, Measured, good_runs
from rig.analysis.session import Analysis
from rig.analysis.unknowns import SharedUnknowns, prior_air
from rig.arrays import Array
from rig.estimate import coefficients as of
from rig.estimate.alphas import SingleAlphas, single_alphas
from rig.estimate.coefficients import CoefficientProblem
from rig.estimate.curves import DropCurves, drop_curves
from rig.estimate.end_correction import EndCorrection, end_correction
from rig.estimate.hypotheses import AIR, CONTACT_U
from rig.estimate.hypothesis_fit import HypothesisFit
from rig.estimate.posterior import Posterior, posterior
from rig.estimate.quadratic_forms import merge_like, quadratic_form
from rig.estimate.rods import Impulses, impulses, resolution
from rig.plain_data import attributes, plain
from rig.protocol.protocol import Protocol
from rig.reasons import make_reason, rig_error
from rig.sections import Sections
from rig.threads import one_thread
from rig.units import Quantity


class Coefficient(NamedTuple):
    """One coefficient of the impacts.

    Attributes
    ----------
    name
        As in the protocol; of given α's with the chain's name behind it.
    identified
        Whether the edges tell it; else it is held by what the protocol states.
    least_squares
        From the edges, and from nothing else where it is identified.
    stated
        In the protocol.
    posterior
        As `Posterior.summary` has it.
    """

    name: str
    identified: bool
    least_squares: Measured
    stated: Quantity
    posterior: Mapping[str, float]

    def json(self) -> dict[str, Any]:
        """One of ``parameters``."""
        stated = {"stated": attributes(self.stated, "value", "u")}
        record = attributes(self, "name", "identified", "least_squares")
        return record | stated | attributes(self, "posterior")


class Coefficients(NamedTuple):
    """The coefficients of the impacts, fitted to all drops.

    Attributes
    ----------
    parameters
        Each coefficient that the protocol leaves open and that has a name here.
    correlation
        Of the parameters by least squares, shape ``(parameters, parameters)``.
    posterior
        Of all parameters.
    contact
        Where the rods touch at each incline, m above the contact level, see `is_identified`.
    drag
        κ in g − κv², 1/m; `None` where the edges tell it no better than the protocol.
    chi2
        Of the edges.
    """

    parameters: tuple[Coefficient, ...]
    correlation: Array
    posterior: Posterior
    contact: Mapping[float, Measured]
    drag: Measured | None
    chi2: float

    def json(self) -> dict[str, Any]:
        """``parameters`` to ``edges_chi2``."""
        record = attributes(self, "parameters")
        record["contact"] = [
            {"incline_deg": at, "identified": is_identified(height), "height_m": height.json()}
            for at, height in self.contact.items()
        ]
        if self.parameters:
            matrix = {"names": self.posterior.names, "matrix": self.correlation}
            record["correlation"] = plain(matrix)
        return record | {"drag_per_m": plain(self.drag), "edges_chi2": self.chi2}


def is_identified(contact: Measured) -> bool:
    """Whether the edges tell a contact point better than is supposed beforehand."""
    return contact.u < of.FOUND * CONTACT_U


@dataclass(slots=True)
class SessionEstimate:
    """What the impacts of a session have in common.

    What could not be worked out is `None`, and missing in JSON.

    Attributes
    ----------
    drops, edges
        How many it rests on.
    left_out
        A sentence on each good run that nothing here rests on, and on each coefficient that the
        edges do not tell; `None` where that is not known.
    failed
        A sentence on each section that could not be worked out.
    """

    drops: int
    edges: int
    left_out: tuple[str, ...] | None = None
    coefficients: Coefficients | None = None
    end_correction: EndCorrection | None = None
    alphas: SingleAlphas | None = None
    impulses: tuple[Impulses, ...] | None = None
    comparison: tuple[Comparison, ...] | None = None
    curves: tuple[DropCurves, ...] | None = None
    failed: tuple[str, ...] = ()

    def json(self) -> dict[str, Any]:
        """As `rig estimate --json` prints it."""
        record = attributes(self, "drops", "edges")
        if self.coefficients is not None:
            record |= self.coefficients.json() | attributes(self, "end_correction")
        if self.alphas is not None:
            record |= self.alphas.json()
        if self.impulses is not None:
            sentence = resolution(self.impulses)
            record["impulses"] = {"inclines": plain(self.impulses), "sentence": sentence}
        optional = ("left_out", "comparison", "curves")
        known = (name for name in optional if getattr(self, name) is not None)
        return record | attributes(self, *known, "failed?")


def check_alike(protocol: Protocol) -> None:
    """Raise an error for a plan that varies what impacts depend on: all but the drop height.

    Raises
    ------
    InputError
        Names the settings.
    """
    scenes = [replace(scene, drop=protocol.drop) for scene in protocol.variants.values()]
    if protocol.surface is not None and any(scene != scenes[0] for scene in scenes):
        raise rig_error("impacts_varied", keys="; ".join(protocol.variants))


@one_thread
def estimate(protocol: Protocol, analysis: Analysis) -> SessionEstimate:
    """Estimate what the impacts of a session have in common.

    Parameters
    ----------
    protocol
        The session's, with a surface.
    analysis
        Of the session.

    Raises
    ------
    InputError
        Where no chain strikes anything, or no drop is good and fits a motion.
    """
    if protocol.surface is None:
        raise rig_error("impacts_absent")
    check_alike(protocol)
    good = {result.job: result.run for result in analysis.runs if result.verdict in GOOD}
    drops = {key: analysis.adjusted[key] for key in good if key in analysis.adjusted}
    if not drops:
        raise rig_error("drops_unfitted" if good else "drops_unusable")
    shared = (
        analysis.joint.shared if analysis.joint else SharedUnknowns(d.model for d in drops.values())
    )
    forms = [quadratic_form(good[key], drop, shared) for key, drop in drops.items()]
    groups = merge_like(forms)
    results = SessionEstimate(len(forms), sum(result.edges for result in forms))
    sections = Sections()
    problem, outcome = None, None
    with sections.alone("The coefficients"):
        problem = of.coefficient_problem(protocol, groups)
        lost = sorted(run for run, _ in good.keys() - drops.keys())
        sentences = (make_reason("run_unfitted", run=run).text for run in lost)
        results.left_out = (*sentences, *problem.left_out)
        if problem.forms:
            outcome = of.best(protocol, problem)
            results.coefficients = _coefficients(protocol, problem, outcome)
    with sections.alone("The end correction"):
        if problem is not None and problem.forms:
            results.end_correction = end_correction(protocol, problem)
    with sections.alone("The best single α"):
        results.alphas = single_alphas(protocol, problem, outcome, forms, groups)
    with sections.alone("The speed gained from each rod"):
        results.impulses = impulses(protocol, groups)
    with sections.alone("The comparison with the model"):
        results.comparison = compare(protocol, good_runs(analysis.runs))
    with sections.alone("The curves"):
        results.curves = tuple(
            drop_curves(protocol, good[key], drops[key], analysis.joint)
            for key, *_ in by_case(protocol, drops, lambda key: good[key]).values()
        )
    results.failed = tuple(sections.failed.values())
    return results


def _coefficients(
    protocol: Protocol, problem: CoefficientProblem, outcome: HypothesisFit
) -> Coefficients:
    """Least squares and posterior, with correlations and nuisances."""
    spread, count = posterior(protocol, problem, outcome), len(problem.stated)
    covariance = outcome.covariance[:count, :count]  # behind them are nuisances
    sd, drag = np.sqrt(covariance.diagonal()), outcome[AIR]
    return Coefficients(
        tuple(
            Coefficient(name, name not in problem.held, outcome[name], stated, spread.summary(name))
            for name, stated in problem.stated.items()
        ),
        covariance / np.outer(sd, sd),
        spread,
        {at: outcome[f"contact {at:g}"] for at in problem.inclines},
        drag if drag.u < of.FOUND * prior_air(protocol)[1] else None,
        outcome.chi2,
    )
