"""Least squares with prior knowledge, and the uncertainties that follow."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.equations import NormalEquations, normal_equations, scaled

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

    from rig.analysis.drop_model import DropModel

    Array = NDArray[np.float64]
    Index = NDArray[np.intp]
    Matches = Mapping[str, Sequence[Index]]

STEPS = 60
"""Of an adjustment, which a good one never needs."""
DONE = 1e-3
"""Of a standard uncertainty: a step so short is the last, for the next one is shorter again."""
PATIENT = 6
"""Steps after which one back is no part of finding the way: an edge at the very moment of an impact
has a slope on either side, and steps go to and fro over the best place, which lies between them."""
_AGAIN = 0.5  # of the last step, taken back by the next one
_STEADY = 0.01  # relative change of chi2 below which it tells the scatter of the edges
_MORE = 1.05  # times as much scatter as assumed, below which edges are weighed as they were


@dataclass(frozen=True)
class Estimate:
    """Unknowns after adjustment.

    Attributes
    ----------
    x, sd
        Best estimates (deviations from nominal) and prior uncertainties, shape ``(unknowns,)``.
    information
        Normal matrix in units of the prior uncertainties, prior included.
    data
        The part of it that comes from edges.
    chi2, edges
        Weighted sum of squares of the edges, and their number.
    scatter
        How much more the edges scatter than assumed; at least 1, and already allowed for.
    settled
        Whether the steps came to an end.
    """

    x: Array
    sd: Array
    information: Array
    data: Array
    chi2: float
    edges: int
    scatter: float
    settled: bool = True

    @cached_property
    def covariance(self) -> Array:
        """Inverse of the normal matrix."""
        return np.linalg.inv(self.information).astype(float, copy=False)

    def beyond(self, x: Array) -> float:
        """How far this is from other unknowns, see `length`."""
        return length(scaled(self.x - x, self.sd), self.information)

    @property
    def degrees(self) -> float:
        """Degrees of freedom: edges less the unknowns that they determine."""
        return self.edges - self.x.size + float(np.trace(self.covariance))


def adjust(
    model: DropModel,
    matches: Matches,
    x: Array,
    centre: Array | None = None,
    done: float = DONE,
    steps: int = STEPS,
) -> Estimate:
    """Find the unknowns that fit all matched edges best.

    Gauss–Newton on ‖r/σ‖² + ‖(x − centre)/sd‖²; residuals beyond 4 σ weigh less (Huber).

    Parameters
    ----------
    matches
        For each side what `rig.analysis.align.align` found.
    x
        Where to begin.
    centre
        Prior means of the unknowns, zero if not given.
    done
        How short a step is the last, see `length`.
    steps
        How many there are at most.
    """
    sd = model.unknowns.sd

    def equations(at: Array, inflation: float) -> NormalEquations:
        return normal_equations(model, matches, at, sd, inflation)

    return least_squares(equations, sd, x, centre, done, steps)


def least_squares(
    equations: Callable[[Array, float], NormalEquations],
    sd: Array,
    x: Array,
    centre: Array | None = None,
    done: float = DONE,
    steps: int = STEPS,
) -> Estimate:
    """Find the unknowns that fit any observations best, given what is known of them beforehand.

    Parameters
    ----------
    equations
        Normal equations about a point, if the observations scatter so many times as assumed.
    sd
        Prior standard uncertainties of the unknowns; where 0 the unknown stays as it is.
    x, centre, done, steps
        As in `adjust`.
    """
    y = scaled(x, sd)
    prior = np.zeros_like(x) if centre is None else scaled(centre, sd)
    identity = np.eye(x.size)
    information = data = identity
    chi2, edges, moved = 0.0, 0, 0.0
    inflation = damping = 1.0
    settled, ahead = False, np.zeros_like(y)
    for step in range(steps):
        found = equations(y * sd, inflation)
        data = found.matrix
        information = data + identity
        right = data @ y - found.vector + prior
        turned, ahead = ahead, np.linalg.solve(information, right).astype(np.float64) - y
        # Steps to and fro that get shorter end by themselves, and sooner.
        taken_back = -(ahead @ information @ turned)
        if step > PATIENT and taken_back > _AGAIN * length(turned, information) ** 2:
            damping *= 0.5
        y = y + damping * ahead
        last, moved = moved, damping * length(ahead, information)
        previous, chi2, edges = chi2, found.chi2, found.size
        # While the unknowns still move, χ² is large for that, and says nothing of the scatter.
        # Unknowns take away less than their number: a chi2 so small needs no closer look.
        calm = chi2 <= edges - x.size
        steady = step and abs(chi2 - previous) <= _STEADY * max(chi2, 1.0)
        if calm or steady:
            factor = 1.0
            # No unknown is left open by less than if all others were known.
            least = edges - x.size + float(np.sum(1.0 / np.diag(information)))
            if chi2 >= _MORE**2 * max(least, 1.0):
                degrees = edges - float(np.trace(np.linalg.solve(information, data)))
                factor = float(np.sqrt(max(1.0, chi2 / max(degrees, 1.0))))
            if factor >= _MORE:
                inflation *= factor  # the edges scatter more than assumed: weigh them so
            elif moved < done or (damping == 1.0 and moved**2 < done * last):
                settled = True
                break
    return Estimate(y * sd, sd, information, data, chi2, edges, inflation, settled)


def length(step: Array, information: Array) -> float:
    """√(dᵀAd): no function of the unknowns moves by more of its own standard uncertainties.

    Parameters
    ----------
    step
        Of the unknowns, in units of their prior uncertainties.
    information
        As in `Estimate`.
    """
    return math.sqrt(max(0.0, float(step @ information @ step)))


def uncertainty(
    estimate: Estimate, gradient: Array, groups: Mapping[str, Sequence[slice]]
) -> tuple[float, dict[str, float]]:
    """Standard uncertainty of a function of the unknowns, and what each source adds to it.

    With A = JᵀJ + 1 in prior units, A⁻¹ = A⁻¹JᵀJA⁻¹ + Σ A⁻¹PA⁻¹, P picking one group: the squares
    of the parts add up to the square of the whole.

    Parameters
    ----------
    gradient
        Derivatives by all unknowns, shape ``(unknowns,)``.
    groups
        Lines of the budget.
    """
    inverse = estimate.covariance @ (gradient * estimate.sd)
    whole = math.sqrt(max(0.0, float(gradient * estimate.sd @ inverse)))
    parts = {
        name: math.sqrt(sum(float(inverse[block] @ inverse[block]) for block in blocks))
        for name, blocks in groups.items()
    }
    edges = math.sqrt(max(0.0, float(inverse @ estimate.data @ inverse)))
    parts["edges"] = math.hypot(edges, parts.get("edges", 0.0))
    return whole, {name: part for name, part in parts.items() if part > 0.0}
