"""Rao's score test: gain of a drop's fit by a shift of the unknowns, without another fit.

It uses the slope and curvature of the log likelihood at the best estimate, along a direction of
the unknowns without a prior.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rig.analysis.fit import Fit
from rig.arrays import Array

_UNTOLD = 1e-12  # share of a direction's information below which other unknowns replace it


class Score(NamedTuple):
    """Score test of a shift along a direction.

    Attributes
    ----------
    size
        Best shift, in units of the direction.
    u
        Its standard uncertainty; infinite if the edges do not determine it.
    gain
        Gain of the log likelihood.
    follow
        Change of the other unknowns for a shift of size 1; shape ``(unknowns,)``.
    """

    size: float
    u: float
    gain: float
    follow: Array


def scores(fit: Fit, directions: Sequence[Array]) -> list[Score]:
    """Return the score test of each direction, as a shift without a prior.

    With J the derivatives of the observations at the estimate, r the residuals, both in standard
    deviations, A = JᵀJ + 1 in units of the priors S, and c = Jd: θ = −cᵀr/h with h = cᵀc −
    cᵀJS A⁻¹ SJᵀc, and the gain is ½ (cᵀr)²/h.

    Parameters
    ----------
    directions
        Directions of the unknowns, shape ``(unknowns,)`` each.
    """
    if not directions:
        return []
    estimate = fit.estimate
    along = np.stack(directions, axis=1)
    slope, full = np.zeros(along.shape[1]), np.zeros(along.shape[1])
    shared = np.zeros(along.shape)
    seen = [(rows, rows.slopes @ along[rows.columns]) for rows in estimate.rows.values()]
    for rows, moved in seen:
        slope += rows.left @ moved
        full += np.sum(moved**2, axis=0)
        shared[rows.columns] += estimate.sd[rows.columns, None] * (rows.slopes.T @ moved)
    follow = estimate.inverse @ (estimate.inverse.T @ shared)
    # Information left by the other unknowns and priors, without a difference of large numbers.
    own = np.sum(follow**2, axis=0)
    for rows, moved in seen:
        rest = moved - rows.slopes @ (estimate.sd[:, None] * follow)[rows.columns]
        own += np.sum(rest**2, axis=0)
    sure = own > _UNTOLD * full
    h = np.where(sure, own, np.inf)
    u = np.where(sure, h**-0.5, np.inf)
    moves = -estimate.sd[:, None] * follow
    sizes, gains = -slope / h, 0.5 * slope**2 / h
    table = zip(sizes.tolist(), u.tolist(), gains.tolist(), moves.T, strict=True)
    return [Score(*one) for one in table]
