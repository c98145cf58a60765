"""Least squares with prior knowledge, and the uncertainties that follow."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.equations import (
    NormalEquations,
    normal_equations,
    scaled,
    with_kept_slopes,
)

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
_KEPT = 0.1  # of the step before, beyond which a step with its slopes is none
_NEAR_BY = 10.0  # standard uncertainties: so long a step slopes of an adjustment before allow
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
    plain
        JᵀWJ and JᵀWr in the unknowns' own units; nothing where no edges were adjusted.
    near
        With the slopes of all edges: what an adjustment of the same edges that begins here may
        begin with. Nothing where they scatter more than assumed.
    """

    x: Array
    sd: Array
    information: Array
    data: Array
    chi2: float
    edges: int
    scatter: float
    settled: bool = True
    plain: tuple[Array, Array] | None = None
    near: NormalEquations | None = field(default=None, repr=False)

    @cached_property
    def covariance(self) -> Array:
        """Inverse of the normal matrix."""
        return np.linalg.inv(self.information).astype(float, copy=False)

    def beyond(self, x: Array) -> float:
        """How far this is from other unknowns, see `length`."""
        return length(scaled(self.x - x, self.sd), self.information)

    @cached_property
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
    near: NormalEquations | None = None,
    *,
    rough: bool = False,
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
    near
        Equations of the same edges about a point near by, see `Estimate`.
    rough
        Whether only the way matters, and edges are weighed as they were.
    """
    sd = model.unknowns.sd

    def equations(at: Array, inflation: float) -> NormalEquations:
        return normal_equations(model, matches, at, sd, inflation)

    def again(at: Array, inflation: float, near: NormalEquations) -> NormalEquations:
        return with_kept_slopes(model, matches, at, sd, inflation, near, rough=rough)

    return least_squares(equations, sd, x, centre, done, steps, again, near, rough=rough)


def least_squares(
    equations: Callable[[Array, float], NormalEquations],
    sd: Array,
    x: Array,
    centre: Array | None = None,
    done: float = DONE,
    steps: int = STEPS,
    again: Callable[[Array, float, NormalEquations], NormalEquations] | None = None,
    near: NormalEquations | None = None,
    *,
    rough: bool = False,
) -> Estimate:
    """Find the unknowns that fit any observations best, given what is known of them beforehand.

    Parameters
    ----------
    equations
        Normal equations about a point, if the observations scatter so many times as assumed.
    sd
        Prior standard uncertainties of the unknowns; where 0 the unknown stays as it is.
    x, centre, done, steps, near, rough
        As in `adjust`.
    again
        The same about a point near by, with the slopes that they had before: much quicker, and as
        good while steps get shorter and shorter.
    """
    y = scaled(x, sd)
    prior = np.zeros_like(x) if centre is None else scaled(centre, sd)
    information = identity = np.eye(x.size)
    found: NormalEquations | None = None
    chi2, moved, most = 0.0, 0.0, 0.0
    inflation = damping = 1.0
    settled, kept, ahead = False, False, np.zeros_like(y)
    if near is not None:
        found, kept, most = near.in_units(sd), True, _NEAR_BY
        information = found.matrix + identity
    for step in range(steps):
        if kept and again is not None and found is not None:
            found = again(y * sd, inflation, found)
        else:
            kept, found = False, equations(y * sd, inflation)
        information = found.matrix + identity
        turned = ahead
        ahead = np.linalg.solve(information, prior - y - found.vector).astype(np.float64)
        size = length(ahead, information)
        if kept and size > most:
            kept, ahead = False, turned  # slopes are others here: once more with these
            continue
        # Steps to and fro that get shorter end by themselves, and sooner.
        if step > PATIENT:
            taken_back = -(ahead @ information @ turned)
            if taken_back > _AGAIN * length(turned, information) ** 2:
                damping *= 0.5
        y = y + damping * ahead
        last, moved = moved, damping * size
        most = _KEPT * moved
        previous, chi2 = chi2, found.chi2
        short = moved < done or (damping == 1.0 and moved**2 < done * last)
        # While the unknowns still move, χ² is large for that, and says nothing of the scatter.
        # Unknowns take away less than their number: a chi2 so small needs no closer look.
        calm = chi2 <= found.size - x.size
        steady = step and abs(chi2 - previous) <= _STEADY * max(chi2, 1.0)
        kept = damping == 1.0 and (rough or calm or bool(steady))
        if not (short if rough else calm or steady):
            continue
        factor = _scatter(found, information)
        if factor >= _MORE:
            inflation *= factor  # the edges scatter more than assumed: weigh them so
            kept = False
        if short and (rough or factor < _MORE):
            settled = True
            break
    if found is None:
        return Estimate(y * sd, sd, information, identity, chi2, 0, inflation, settled)
    plain = found.plain
    if plain is not None:
        # As it is after the last step.
        plain = plain[0], plain[1] + plain[0] @ (damping * ahead * sd)
    return Estimate(
        y * sd,
        sd,
        information,
        found.matrix,
        chi2,
        found.size,
        inflation,
        settled,
        plain,
        found if inflation == 1.0 else None,
    )


def _scatter(found: NormalEquations, information: Array) -> float:
    """How many times as much as assumed observations scatter; 1 where that is near enough."""
    free = found.size - len(information)
    # No unknown is left open by less than if all others were known.
    least = free + float(np.sum(1.0 / np.diag(information)))
    if found.chi2 < _MORE**2 * max(least, 1.0):
        return 1.0
    degrees = found.size - float(np.trace(np.linalg.solve(information, found.matrix)))
    return math.sqrt(max(1.0, found.chi2 / max(degrees, 1.0)))


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
    squares = (inverse * inverse).tolist()  # of blocks so short, Python's own sums are quicker
    parts = {
        name: math.sqrt(sum(sum(squares[block]) for block in blocks))
        for name, blocks in groups.items()
    }
    edges = math.sqrt(max(0.0, float(inverse @ estimate.data @ inverse)))
    parts["edges"] = math.hypot(edges, parts.get("edges", 0.0))
    return whole, {name: part for name, part in parts.items() if part > 0.0}
