"""Vectorized falls of a chain, with the same results as `rig.model.fall.fall` for each.

Impacts are those of `rig.model.fall.after_impacts`, so that with the same α and γ not a bit
differs as long as squares of its sizes are floats. α itself uses numpy's sine and cosine, which may
differ from the C library's in the last digit; near a singular Eq. 13 that digit has more effect.

There are no errors or warnings: falls without a solution give `NaN`.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rig.arrays import Array, Flags
from rig.model.chain import Chain
from rig.model.fall import after_impacts
from rig.model.impact import alpha_level, contact_share, gamma_finite
from rig.model.surface import Pile

# Falls computed together. A dozen arrays of this size fit into the second-level cache, and each is
# long enough to make numpy's overhead for a call negligible.
_BLOCK = 8192


class Impacts(NamedTuple):
    """Coefficients of Eq. 9; arrays broadcast with each other.

    Attributes
    ----------
    alpha, gamma
        `NaN` where Eq. 13 is singular.
    sliding
        False where f = μN does not hold because the incline is below arctan μ.
    """

    alpha: Array
    gamma: Array
    sliding: Flags


def given_impacts(alpha: ArrayLike, gamma: ArrayLike = 0.0) -> Impacts:
    """Return coefficients with stated values, as for a bead chain."""
    return Impacts(_floats(alpha), _floats(gamma), np.ones(np.shape(alpha), np.bool_))


def surface_impacts(
    incline_deg: ArrayLike,
    restitution: ArrayLike,
    friction: ArrayLike,
    inertia: ArrayLike,
    *,
    inertia_z: ArrayLike | None,
    pile: Pile | None,
    gamma: ArrayLike | None = None,
) -> Impacts:
    """Return coefficients for a surface, Eqs. 8, 10, 12 and 13; all arguments broadcast.

    Parameters
    ----------
    incline_deg, restitution, friction
        θ in degrees, β and μ.
    inertia, inertia_z
        ξ_y, and ξ_z where it is not the same.
    gamma
        Replaces Eq. 10.
    pile
        As in `rig.model.impact.impact_on`: lower inclines count as level and have the pile's β.
    """
    theta_deg, beta, mu, xi = map(_floats, (incline_deg, restitution, friction, inertia))
    level = theta_deg == 0.0
    if pile is not None:
        piled = theta_deg < pile.below_deg
        beta = np.where(piled, pile.restitution.value, beta)
        level = level | piled
    free_rod = gamma_finite(xi, None if inertia_z is None else _floats(inertia_z))
    with np.errstate(all="ignore"):
        # As in rig.model.impact.alpha_inclined: cos θ with full precision near 90°, where α is 0.
        sin = np.sin(np.radians(theta_deg))
        cos = np.sin(np.radians(90.0 - theta_deg))
        g = contact_share(sin, cos, mu, free_rod)
        g = np.where((g > 0.0) & np.isfinite(g), g, np.nan)
        eq_8 = alpha_level(beta, xi)
        inclined = np.where(cos == 0.0, 0.0, eq_8 * cos / g)
    sliding = level | (theta_deg >= np.degrees(np.arctan(mu)))
    eq_10 = gamma_finite(xi) if gamma is None else _floats(gamma)
    return Impacts(np.where(level, eq_8, inclined), eq_10, sliding)


def falls(
    masses: ArrayLike,
    heights: ArrayLike,
    impacts: Impacts,
    drop: ArrayLike,
    gravity: ArrayLike,
    initial_speed: ArrayLike = 0.0,
) -> Array:
    """Return Δz, V and t of many falls (Eq. 9 and section III.D).

    Parameters
    ----------
    masses, heights
        As in `rig.model.chain.Chain`, bottom up; shape ``(rods,)``.
    impacts
        From `surface_impacts` or `given_impacts`.
    drop, gravity, initial_speed
        As in `rig.model.fall.hits`: m, m/s² and m/s; these and the impacts broadcast.

    Returns
    -------
    ndarray
        Δz, V and t as in `rig.model.fall.Fall`, each of the shape to which the inputs broadcast;
        `NaN` without a finite α.
    """
    legs = Chain(tuple(_floats(masses).tolist()), tuple(_floats(heights).tolist())).legs
    inputs = impacts.alpha, impacts.gamma, *map(_floats, (drop, gravity, initial_speed))
    shaped = np.broadcast_arrays(*inputs)
    flat = [array.reshape(-1) for array in shaped]
    ends = np.empty((3, flat[0].size))
    with np.errstate(all="ignore"):
        for start in range(0, flat[0].size, _BLOCK):
            block = slice(start, start + _BLOCK)
            alpha, gamma, way, g, speed = (array[block] for array in flat)
            arrival = np.where(way == 0.0, speed, np.sqrt(speed * speed + 2.0 * g * way))
            # A rod released on the contact point strikes at once; its leg's time was 0/0.
            time = np.where(way == 0.0, 0.0, 2.0 * way / (speed + arrival))
            ends[:, block] = after_impacts(legs, alpha, gamma, arrival, time, 2.0 * g, np.sqrt)
    return ends.reshape(3, *shaped[0].shape)


def _floats(values: ArrayLike) -> Array:
    return np.asarray(values, dtype=np.float64)
