"""All drops of a session under one hypothesis about their impacts: generalised least squares."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.errors import RigError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from rig.estimate.quadratic_forms import QuadraticForm

    Array = NDArray[np.float64]

ANYTHING = 1.0
"""How far a parameter may be from where the search begins when nothing is known of it: coefficients
are of order one, and a fit with a parameter that no edge tells of must still end."""
_STEPS = 60
_DONE = 1e-5  # of a standard uncertainty


class Parameter(NamedTuple):
    """One parameter of a hypothesis.

    Attributes
    ----------
    name
        To find it.
    start
        Where the search begins.
    prior
        What is known of it without the edges: mean and standard uncertainty; `None` if nothing
        (see `ANYTHING`).
    """

    name: str
    start: float
    prior: tuple[float, float] | None = None


class Hypothesis(NamedTuple):
    """What the impacts of every drop would be.

    Attributes
    ----------
    parameters
        Their vector is the argument of `targets`.
    targets
        From a drop and the parameters, α of every rod and the extras of
        `rig.estimate.quadratic_forms`, shape ``(n,)``, with the derivatives, shape
        ``(n, parameters)``.
    """

    parameters: tuple[Parameter, ...]
    targets: Callable[[QuadraticForm, Array], tuple[Array, Array]]


@dataclass(frozen=True, slots=True)
class HypothesisFit:
    """A hypothesis where it fits best.

    Attributes
    ----------
    names
        Of the parameters.
    values, covariance
        Estimates, and their covariance with all nuisances allowed for.
    chi2
        Weighted sum of squares, priors included.
    log_volume
        ½ ln det of the covariance of all that was fitted: what a marginal likelihood has beside
        −½χ².
    """

    names: tuple[str, ...]
    values: Array
    covariance: Array
    chi2: float
    log_volume: float

    def __getitem__(self, name: str) -> tuple[float, float]:
        """Value and standard uncertainty of a parameter."""
        n = self.names.index(name)
        return float(self.values[n]), float(np.sqrt(self.covariance[n, n]))

    def __contains__(self, name: object) -> bool:
        return name in self.names


def fit(forms: Sequence[QuadraticForm], hypothesis: Hypothesis) -> HypothesisFit:
    """Find the parameters at which the edges of all drops are most likely (Gauss–Newton).

    Parameters
    ----------
    forms
        Of one session.
    hypothesis
        What is fitted.

    Raises
    ------
    RigError
        Where the steps do not come to an end: the edges say too little of some parameter.
    """
    parameters = hypothesis.parameters
    shared = 1 + max((int(form.here.max(initial=-1)) for form in forms), default=-1)
    values = np.array([one.start for one in parameters])
    c = np.zeros(shared)
    priors = [one.prior or (one.start, ANYTHING) for one in parameters]
    centre = np.array([mean for mean, _ in priors])
    weight = np.array([u**-2 for _, u in priors])
    known = np.eye(shared)  # what does not depend on the parameters
    for form in forms:
        known[np.ix_(form.here, form.here)] += form.matrix[: form.here.size, : form.here.size]
    for _ in range(_STEPS):
        total = np.zeros((shared + values.size, shared + values.size))
        total[:shared, :shared] = known
        total[shared:, shared:] = np.diag(weight)
        slope = np.concatenate([c, weight * (values - centre)])
        chi2 = float(c @ c + weight @ (values - centre) ** 2)
        for form in forms:
            target, by_parameters = hypothesis.targets(form, values)
            n = form.here.size
            z = np.concatenate([c[form.here], target])
            pull = form.matrix @ z
            chi2 += float(z @ (pull + 2.0 * form.vector)) + form.constant
            slope[form.here] += pull[:n] + form.vector[:n]
            slope[shared:] += by_parameters.T @ (pull[n:] + form.vector[n:])
            total[form.here, shared:] += form.matrix[:n, n:] @ by_parameters
            # The targets are taken as linear: where the fit is good, their curvature counts little.
            total[shared:, shared:] += by_parameters.T @ form.matrix[n:, n:] @ by_parameters
        total[shared:, :shared] = total[:shared, shared:].T
        # A few tens of unknowns: the inverse costs little, and its diagonal says when to stop.
        covariance = np.linalg.inv(total).astype(np.float64, copy=False)
        step = -covariance @ slope
        c, values = c + step[:shared], values + step[shared:]
        sd = np.sqrt(np.diag(covariance))
        if float(np.abs(step / sd).max()) < _DONE:
            names = tuple(one.name for one in parameters)
            volume = -0.5 * float(np.linalg.slogdet(total)[1])
            return HypothesisFit(names, values, covariance[shared:, shared:], chi2, volume)
    raise RigError("the fit does not settle", "rig analyze shows whether the drops are sound")
