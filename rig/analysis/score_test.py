"""How much better a drop would fit if something were off its place, without fitting it again.

Rao's score test: at the best estimate, from the slope and the curvature of the likelihood along a
direction of the unknowns in which nothing is known beforehand.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.analysis.fit import Fit
    from rig.arrays import Array


_UNTOLD = 1e-12  # of what the edges tell, below which the other unknowns do it as well


class Score(NamedTuple):
    """What a shift along one direction would do.

    Attributes
    ----------
    size
        By how much to shift, in units of the direction.
    u
        Its standard uncertainty; infinite where the edges tell nothing of it.
    gain
        By how much the logarithm of the likelihood would be more.
    follow
        How much the unknowns would then move, for a shift of size 1; shape ``(unknowns,)``.
    """

    size: float
    u: float
    gain: float
    follow: Array


def scores(fit: Fit, directions: Sequence[Array]) -> list[Score]:
    """Try shifts of the unknowns that cost nothing beforehand.

    With J the observation equations at the estimate, r what they leave over, both in standard
    deviations, A = JᵀJ + 1 in units of the priors S, and c = Jd: θ = −cᵀr/h with h = cᵀc −
    cᵀJS A⁻¹ SJᵀc, and the gain is ½ (cᵀr)²/h.

    Parameters
    ----------
    directions
        Shape ``(unknowns,)`` each.
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
    # What other unknowns do not do as well, priors included: no difference of large numbers.
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
