"""All drops of a session under one hypothesis about their impacts: generalised least squares."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import numpy as np

from rig.analysis.adjust import least_squares
from rig.analysis.distributions import chi2_tail
from rig.analysis.equations import Linearization, standardise
from rig.analysis.result import Measured
from rig.analysis.square_root import EquationRows
from rig.arrays import Array
from rig.errors import RigError
from rig.estimate.quadratic_forms import EXTRA, QuadraticForm
from rig.plain_data import attributes

ANYTHING = 1.0
"""How far a parameter may be from where the search begins when nothing is known of it: coefficients
are of order one, and a fit with a parameter that no edge tells of must still end."""
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
        What is known of it without the edges: mean and standard uncertainty, 0 where it is exact;
        `None` if nothing (see `ANYTHING`).
    extra
        Which of `rig.estimate.quadratic_forms.EXTRA` it is; of what α depends on `None`.
    incline_deg
        The only incline that it belongs to, if there is one.
    """

    name: str
    start: float
    prior: tuple[float, float] | None = None
    extra: str | None = None
    incline_deg: float | None = None


class Hypothesis(NamedTuple):
    """What the impacts of every drop would be.

    Attributes
    ----------
    parameters
        Of all that is supposed.
    alphas
        From a drop and those parameters that are no extra, α of every rod, shape ``(rods,)``, with
        the derivatives, shape ``(rods, parameters)``; or without the rods, where it is one α.
    """

    parameters: tuple[Parameter, ...]
    alphas: Callable[[QuadraticForm, Array], tuple[float | Array, Array]]

    def targets(self, form: QuadraticForm, values: Array) -> tuple[Array, Array]:
        """Return α of every rod and the extras, shape ``(n,)``, with their derivatives."""
        rods, size = form.alphas.size, form.alphas.size + len(EXTRA)
        target, slopes = np.zeros(size), np.zeros((size, values.size))
        of_alpha = [n for n, parameter in enumerate(self.parameters) if parameter.extra is None]
        target[:rods], slopes[:rods, of_alpha] = self.alphas(form, values[of_alpha])
        for n, (_, _, _, extra, incline) in enumerate(self.parameters):
            if extra is not None and incline in {None, form.run.incline_deg}:
                row = rods + EXTRA.index(extra)
                target[row] += values[n]
                slopes[row, n] = 1.0
        return target, slopes


class LikelihoodRatio(NamedTuple):
    """A likelihood-ratio test.

    Attributes
    ----------
    chi2
        By how much χ² is larger for the narrower hypothesis.
    degrees
        How many parameters it has less.
    """

    chi2: float
    degrees: int

    @property
    def p(self) -> float | None:
        """How often chance alone would make χ² as large; `None` without degrees of freedom."""
        return chi2_tail(self.chi2, self.degrees) if self.degrees > 0 else None

    def json(self) -> dict[str, Any]:
        """``{"chi2", "degrees", "p"}``."""
        return attributes(self, "chi2", "degrees", "p")


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
        ½ ln det of the covariance of all that is not exact: what a marginal likelihood has beside
        −½χ².
    """

    names: tuple[str, ...]
    values: Array
    covariance: Array
    chi2: float
    log_volume: float

    def __getitem__(self, name: str) -> Measured:
        """Value and standard uncertainty of a parameter."""
        n = self.names.index(name)
        return Measured(float(self.values[n]), float(np.sqrt(self.covariance[n, n])))

    def against(self, wider: Self) -> LikelihoodRatio:
        """Test it against a hypothesis in which it is contained; rounding makes no χ² negative."""
        degrees = len(wider.names) - len(self.names)
        return LikelihoodRatio(max(0.0, self.chi2 - wider.chi2), degrees)


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
    priors = [parameter.prior or (parameter.start, ANYTHING) for parameter in parameters]
    centre = np.append(np.zeros(shared), [mean for mean, _ in priors])
    begin = np.append(np.zeros(shared), [parameter.start for parameter in parameters]) - centre
    sd = np.append(np.ones(shared), [u for _, u in priors])

    def linearize(off: Array, _inflation: float) -> Linearization:
        at, blocks = centre + off, {}
        for number, form in enumerate(forms):
            target, by_parameters = hypothesis.targets(form, at[shared:])
            slopes, remainder, _ = form.rows.after(np.append(at[form.here], target))
            n = form.here.size
            # The targets are taken as linear: where the fit is good, their curvature counts little.
            slopes = np.column_stack([slopes[:, :n], slopes[:, n:] @ by_parameters])
            columns = np.append(form.here, np.arange(shared, at.size))
            blocks[str(number)] = EquationRows(slopes, remainder, columns)
        chi2 = sum(float(rows.left @ rows.left) for rows in blocks.values())
        return Linearization(blocks, chi2, sum(form.edges for form in forms), chi2)

    solution = least_squares(linearize, sd, begin, done=_DONE, as_stated=True)
    if not solution.settled:
        raise RigError("the fit does not settle", "rig analyze shows whether the drops are sound")
    chi2 = sum(float(rows.left @ rows.left) for rows in solution.rows.values())
    chi2 += float(np.sum(standardise(solution.x, sd) ** 2))
    by_root = solution.inverse[shared:] * sd[shared:, None]
    volume = float(np.sum(np.log(sd[sd > 0.0])) - np.linalg.slogdet(solution.root)[1])
    names = tuple(parameter.name for parameter in parameters)
    values = centre[shared:] + solution.x[shared:]
    return HypothesisFit(names, values, by_root @ by_root.T, chi2, volume)
