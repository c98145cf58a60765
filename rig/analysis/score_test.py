"""Rao's score test: gain of a drop's fit by a shift of the unknowns, without another fit.

It uses the slope and curvature of the log likelihood at the best estimate, along a direction of
the unknowns without a prior.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rig.analysis.annealing import matched
from rig.analysis.faults import Braked
from rig.analysis.fit import Fit
from rig.arrays import Array


class Scores(NamedTuple):
    """Score tests of shifts along directions.

    Attributes
    ----------
    size, u
        Best shift, in units of each direction, and its standard uncertainty, infinite if the edges
        do not determine it; shape ``(directions,)``.
    gain
        Gain of the log likelihood, shape ``(directions,)``.
    follow
        Change of the other unknowns for a shift of size 1; shape ``(unknowns, directions)``.
    """

    size: Array
    u: Array
    gain: Array
    follow: Array


def scores(
    fit: Fit, directions: Sequence[Array], brakes: Sequence[Braked | None] = (None,)
) -> Scores:
    """Return the score test of each direction, as a shift without a prior.

    With J the derivatives of the observations at the estimate, r the residuals, both in standard
    deviations, A = JᵀJ + 1 in units of the priors S, and c = Jd: θ = −cᵀr/h with h = cᵀc −
    cᵀJS A⁻¹ SJᵀc, and the gain is ½ (cᵀr)²/h.

    Parameters
    ----------
    directions
        Directions of the unknowns, shape ``(unknowns,)`` each.
    brakes
        What each direction does in addition.
    """
    estimate, along = fit.estimate, np.reshape(directions, (-1, fit.x.size)).T
    blocks, moves = [], []
    for role, side in estimate.rows.items():
        block = np.zeros((side.left.size, fit.x.size))
        block[:, side.columns] = side.slopes
        moves.append(block @ along)
        late = {n: brake.late for n, brake in enumerate(brakes) if brake and brake.side == role}
        if late:  # a brake acts as if the release had been later for each edge
            pick, release = matched(fit.matches[role])[0], fit.model.unknowns[f"{role} release"]
            moves[-1][:, [*late]] += block[:, release] * np.stack([*late.values()], axis=1)[pick]
        blocks.append(block)
    jacobian, moved = np.concatenate(blocks), np.concatenate(moves)
    left = np.concatenate([side.left for side in estimate.rows.values()])
    jacobian *= estimate.sd
    follow = -estimate.inverse @ (estimate.inverse.T @ (jacobian.T @ moved))
    # Information left by the other unknowns and priors, without a difference of large numbers.
    own = np.sum((moved + jacobian @ follow) ** 2, axis=0) + np.sum(follow**2, axis=0)
    # A direction with less than half of a double's digits left is replaced by other unknowns.
    h = np.where(own > math.sqrt(np.finfo(float).eps) * np.sum(moved**2, axis=0), own, np.inf)
    slope, u = left @ moved, np.where(np.isfinite(h), h**-0.5, np.inf)
    return Scores(-slope / h, u, 0.5 * slope**2 / h, estimate.sd[:, None] * follow)
