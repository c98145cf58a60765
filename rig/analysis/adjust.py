"""Robust non-linear least squares with priors, and the covariance of the estimates."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from rig.analysis.drop_model import DropModel
from rig.analysis.equations import Linearization, linearize, standardise
from rig.analysis.square_root import EquationRows, Root, square_root
from rig.arrays import Array, Index

Matches = Mapping[str, Index]

STEPS = 60
"""Greatest number of steps of a fit; a good fit needs far fewer."""
DONE = 0.1
"""Step length in standard uncertainties that ends a fit: convergence is quadratic. With half of it
no result changes by 0.001 standard uncertainties."""
PATIENT = 4
"""Short steps in a row after which a fit has converged. An edge at the moment of an impact has a
different slope on either side, and steps may alternate between them."""
_DAMPED = 1e-3  # first λ of Levenberg and Marquardt
_FACTOR = 4.0  # by which λ grows with each rejected step, and shrinks with each accepted one
_GAIN = 0.25  # least share of the linear prediction by which a step reduces the loss
_MORE = 1.05  # least change of the scatter with which edges are weighed anew


@dataclass(frozen=True)
class Estimate:
    """Result of a fit.

    Attributes
    ----------
    x, sd
        Best estimates (deviations from nominal) and prior uncertainties, shape ``(unknowns,)``.
    root
        R of the information RᵀR in units of the prior uncertainties, prior included.
    chi2, edges
        Weighted sum of squares of the edges, and their number.
    scatter
        Scatter of the edges relative to the assumed scatter; at least 1, and included in `root`.
    settled
        Whether the fit converged.
    rows
        Residuals of each side and their derivatives.
    """

    x: Array
    sd: Array
    root: Array
    chi2: float
    edges: int
    scatter: float
    settled: bool = True
    rows: Mapping[str, EquationRows] = field(default_factory=dict, repr=False)

    @cached_property
    def inverse(self) -> Array:
        """R⁻¹, a square root of the covariance in units of the prior uncertainties."""
        return np.linalg.inv(self.root).astype(float, copy=False)

    @cached_property
    def own_u(self) -> Array:
        """Standard uncertainty of each unknown."""
        return np.asarray(np.linalg.norm(self.inverse, axis=1) * self.sd)

    @cached_property
    def degrees(self) -> float:
        """Degrees of freedom: edges less the unknowns that they determine."""
        return self.edges - self.x.size + float(np.sum(self.inverse**2))


def adjust(
    model: DropModel, matches: Matches, x: Array, centre: Array | None = None, done: float = DONE
) -> Estimate:
    """Fit all unknowns of a drop to its matched edges.

    Gauss–Newton on ‖r/σ‖² + ‖(x − centre)/sd‖²; residuals beyond 4 σ weigh less (Huber). Unknowns
    without a prior do not count in the second sum.

    Parameters
    ----------
    matches
        For each side the result of `rig.analysis.annealing.Pairing.match`.
    x
        First guess.
    centre
        Prior means of the unknowns, zero if not given.
    done
        Length of the last step, see `length`.
    """

    def about(at: Array, inflation: float) -> Linearization:
        return linearize(model, matches, at, inflation)

    at = model.unknowns
    centre = np.where(at.flat, math.nan, 0.0 if centre is None else centre)
    return least_squares(about, at.sd, x, centre, done)


@np.errstate(all="ignore")  # a step to a NaN loss is rejected
def least_squares(
    linearize: Callable[[Array, float], Linearization],
    sd: Array,
    x: Array,
    centre: Array | None = None,
    done: float = DONE,
    steps: int = STEPS,
    *,
    as_stated: bool = False,
) -> Estimate:
    """Fit unknowns with normal priors to any observations.

    Takes Gauss–Newton steps. A step that increases the loss, or makes it NaN, is rejected, and
    shorter steps are tried (Levenberg–Marquardt).

    Parameters
    ----------
    linearize
        Function of a point and a factor of scatter that returns the linearized observations.
    sd
        Prior standard uncertainties of the unknowns; 0 holds an unknown fixed.
    centre
        Prior means, zero if not given; NaN for an unknown without a prior.
    x, done
        As in `adjust`.
    steps
        Greatest number of steps.
    as_stated
        Whether the observations scatter as assumed; otherwise their scatter is estimated.

    Returns
    -------
    Estimate
        Finite estimates; not `settled` if the fit did not converge.
    """
    prior = np.zeros_like(x) if centre is None else standardise(centre, sd)

    def look(y: Array, inflation: float) -> _Point:
        pull = np.where(np.isnan(prior), 0.0, y - prior)
        return _Point(y, inflation, linearize(y * sd, inflation), sd, pull)

    point = look(standardise(x, sd), 1.0)
    if not math.isfinite(point.loss):
        return Estimate(x, sd, np.eye(x.size), math.inf, 0, 1.0, settled=False)
    damping, previous, step = 0.0, 0.0, np.zeros_like(x)
    inflation, settled, shorts = 1.0, False, 0
    for _ in range(steps):
        step = point.root.damp(damping).step() if damping else point.root.step()
        moved = length(step, point.root.matrix)
        near = point.size < point.usual
        # With linear convergence, the next step is shorter by the ratio of the last two.
        shorts = shorts + 1 if moved < done else 0
        last = point.size < done or shorts > PATIENT
        short = near and (last or (not damping and moved**2 < done * previous))
        if short or (near and not as_stated):
            factor = point.excess()
            inflation = point.inflation * factor
            settled = short and (as_stated or factor == 1.0)
            if settled:
                break
            if factor != 1.0:
                point, previous = look(point.y, inflation), 0.0
                continue
        ahead = look(point.y + step, point.inflation)
        if not ahead.loss <= point.loss - _GAIN * point.predicted_reduction(step):
            damping = damping * _FACTOR or _DAMPED
            continue
        shorts = 0 if ahead.loss < point.loss - done**2 else shorts
        point, previous = ahead, moved
        damping /= _FACTOR
    step = step if settled else np.zeros_like(x)
    return Estimate(
        (point.y + step) * sd,
        sd,
        point.root.matrix,
        point.seen.chi2,
        point.seen.size,
        inflation,
        settled,
        {role: rows.after(step * sd) for role, rows in point.seen.rows.items()},
    )


@dataclass(frozen=True)
class _Point:
    """A point of a search.

    Attributes
    ----------
    y
        Unknowns in units of their prior uncertainties.
    inflation, seen
        Scatter of the observations relative to the assumed scatter, and the linearization with it.
    sd, pull
        Prior uncertainties, and deviations of the unknowns from the prior means in these units.
    """

    y: Array
    inflation: float
    seen: Linearization
    sd: Array
    pull: Array

    @property
    def loss(self) -> float:
        """Loss that the fit minimizes, priors included."""
        return self.seen.loss + float(self.pull @ self.pull)

    @property
    def usual(self) -> float:
        """Scatter of the observations relative to the present assumption; at least 1."""
        return math.sqrt(max(1.0, self.seen.chi2 / max(1, self.seen.size)))

    @cached_property
    def root(self) -> Root:
        """Square root of the information of observations and priors."""
        return square_root([*self.seen.rows.values()], self.sd, self.pull)

    @property
    def size(self) -> float:
        """Length of the Gauss–Newton step, see `length`."""
        return float(np.linalg.norm(self.root.left))

    def predicted_reduction(self, step: Array) -> float:
        """Return the reduction of the loss that the linear model predicts for a step."""
        remainder = self.root.left + self.root.matrix @ step
        return float(self.root.left @ self.root.left - remainder @ remainder)

    def excess(self) -> float:
        """Return the scatter relative to the present assumption; 1 if it is close enough.

        The total never falls below the assumed scatter.
        """
        seen = self.seen
        # The scatter would be at most this if every unknown used a whole degree of freedom.
        if self.inflation == 1.0 and seen.chi2 < _MORE**2 * (seen.size - self.y.size):
            return 1.0
        inverse = np.linalg.inv(self.root.matrix)
        degrees = max(1.0, seen.size - len(inverse) + float(np.sum(inverse**2)))
        factor = max(math.sqrt(seen.chi2 / degrees), 1.0 / self.inflation)
        return 1.0 if 1.0 / _MORE < factor < _MORE else factor


def length(step: Array, root: Array) -> float:
    """Return |R·d|: no function of the unknowns changes by more standard uncertainties of its own.

    Parameters
    ----------
    step
        Change of the unknowns, in units of their prior uncertainties.
    root
        As in `Estimate`.
    """
    return float(np.linalg.norm(root @ step))
