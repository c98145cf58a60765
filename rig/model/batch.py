"""Vectorized falls of a chain, with the same results as `rig.model.fall.fall` for each.

Every step is that of `rig.model.fall.fall`, in its order, so that with the same α and γ not a bit
differs as long as squares of its sizes are floats. α itself uses numpy's sine and cosine, which may
differ from the C library's in the last digit; near a singular Eq. 13 that digit has more effect.

There are no errors or warnings: falls without a solution give `NaN`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rig.model.chain import UNIFORM_ROD_INERTIA
from rig.model.impact import alpha_level, contact_share, gamma_finite

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.model.surface import Pile

Floats: TypeAlias = NDArray[np.float64]
Flags: TypeAlias = NDArray[np.bool_]

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

    alpha: Floats
    gamma: Floats
    sliding: Flags


def given_impacts(alpha: ArrayLike, gamma: ArrayLike = 0.0) -> Impacts:
    """Return coefficients with stated values, as for a bead chain."""
    return Impacts(_floats(alpha), _floats(gamma), np.ones(np.shape(alpha), np.bool_))


def surface_impacts(
    incline_deg: ArrayLike,
    restitution: ArrayLike,
    friction: ArrayLike = 0.0,
    inertia: ArrayLike = UNIFORM_ROD_INERTIA,
    *,
    inertia_z: ArrayLike | None = None,
    gamma: ArrayLike | None = None,
    pile: Pile | None = None,
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
) -> Floats:
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
    mass = _floats(masses)
    above = np.cumsum(mass[:0:-1])[::-1]  # from the top, as in rig.model.chain.Chain.legs
    legs = [*zip(np.diff(_floats(heights)).tolist(), (above / mass[:-1]).tolist(), strict=True)]
    inputs = impacts.alpha, impacts.gamma, *map(_floats, (drop, gravity, initial_speed))
    shape = np.broadcast_shapes(*(array.shape for array in inputs))
    flat = [np.broadcast_to(array, shape).reshape(-1) for array in inputs]
    ends = np.empty((3, flat[0].size))
    with np.errstate(all="ignore"):
        for start in range(0, flat[0].size, _BLOCK):
            block = slice(start, start + _BLOCK)
            ends[:, block] = _block_ends(legs, *(array[block] for array in flat))
    return ends.reshape(3, *shape)


def _block_ends(legs: Sequence[tuple[float, float]], *inputs: Floats) -> tuple[Floats, ...]:
    """Return Δz, V and t of falls, rod by rod; inputs as in `falls`, of shape ``(falls,)``."""
    alpha, gamma, drop, gravity, initial_speed = inputs
    twice_g = gravity * 2.0
    arrival = np.sqrt(initial_speed * initial_speed + twice_g * drop)
    # A rod released on the contact point strikes at once; its leg's time was 0/0.
    arrival = np.where(drop == 0.0, initial_speed, arrival)
    time = np.where(drop == 0.0, 0.0, 2.0 * drop / (initial_speed + arrival))
    gained, separation, speed, step = np.zeros((4, drop.size))
    # In place: a fresh array for each result takes longer than its arithmetic.
    for gap, ratio in legs:
        np.add(gamma, ratio, out=step)
        np.divide(alpha, step, out=step)
        step *= arrival  # Eq. 9
        gained += step
        np.add(arrival, step, out=speed)
        np.multiply(speed, speed, out=arrival)
        np.multiply(twice_g, gap, out=step)
        arrival += step
        np.sqrt(arrival, out=arrival)
        speed += arrival
        duration = np.divide(2.0 * gap, speed, out=speed)
        time += duration
        duration *= gained
        separation += duration
    return separation, arrival, time


def _floats(values: ArrayLike) -> Floats:
    return np.asarray(values, dtype=np.float64)
