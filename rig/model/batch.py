"""Many falls of one chain at once: arrays in, arrays out, the same numbers as one fall at a time.

Every step is that of `rig.model.fall.fall`, in its order, so that with the same α and γ not a bit
differs as long as squares of its sizes are floats. α itself rests on numpy's sine and cosine, which
may differ from the C library's in the last digit; near a singular Eq. 13 that digit weighs more.

Nothing is raised and no warning given: where a single fall has no answer the results are `NaN`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rig.model.chain import UNIFORM_ROD_INERTIA

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.model.surface import Pile

Floats: TypeAlias = NDArray[np.float64]
Flags: TypeAlias = NDArray[np.bool_]

# Falls that pass all rods together. A dozen arrays of so many stay in the second-level cache, and
# one is long enough that numpy's time for a call does not count.
_BLOCK = 8192


class Impacts(NamedTuple):
    """Coefficients of Eq. 9; arrays broadcast with each other.

    Attributes
    ----------
    alpha, gamma
        `NaN` where Eq. 13 is singular.
    sliding
        False where f = μN does not hold, the incline being below arctan μ.
    """

    alpha: Floats
    gamma: Floats
    sliding: Flags


class FallBatch(NamedTuple):
    """The ends of falls; every array has the shape to which the inputs broadcast.

    Attributes
    ----------
    separation_m, speed_m_s, time_s
        Δz, V and t as in `rig.model.fall.Fall`; `NaN` where there is no α.
    """

    separation_m: Floats
    speed_m_s: Floats
    time_s: Floats


def given_impacts(alpha: ArrayLike, gamma: ArrayLike = 0.0) -> Impacts:
    """Coefficients that are simply given, as for a bead chain."""
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
    """Coefficients that follow from the surface, Eqs. 8, 10, 12 and 13; all arguments broadcast.

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
    eq_10 = _gamma(xi, xi)
    free_rod = eq_10 if inertia_z is None else _gamma(xi, _floats(inertia_z))
    with np.errstate(all="ignore"):
        # As in rig.model.impact.alpha_inclined: Eq. 13 × (cos θ + μ sin θ), and cos θ that
        # keeps its digits near 90°, where there is no pull.
        sin = np.sin(np.radians(theta_deg))
        cos = np.sin(np.radians(90.0 - theta_deg))
        g = cos + free_rod * sin * (sin - mu * cos) / (cos + mu * sin)
        g = np.where((g > 0.0) & np.isfinite(g), g, np.nan)
        eq_8 = (1.0 + beta) / 4.0 * (1.0 - xi)
        inclined = np.where(cos == 0.0, 0.0, eq_8 * cos / g)
    sliding = level | (theta_deg >= np.degrees(np.arctan(mu)))
    return Impacts(
        np.where(level, eq_8, inclined), eq_10 if gamma is None else _floats(gamma), sliding
    )


def falls(
    masses: ArrayLike,
    heights: ArrayLike,
    impacts: Impacts,
    drop: ArrayLike,
    gravity: ArrayLike,
    initial_speed: ArrayLike = 0.0,
) -> FallBatch:
    """Δz, V and t of many falls (Eq. 9 and section III.D).

    Parameters
    ----------
    masses, heights
        As in `rig.model.chain.Chain`, bottom up; shape ``(rods,)``.
    impacts
        From `surface_impacts` or `given_impacts`.
    drop, gravity, initial_speed
        As in `rig.model.fall.hits`: m, m/s² and m/s; these and the impacts broadcast.
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
    return FallBatch(*(row.reshape(shape) for row in ends))


def _block_ends(legs: Sequence[tuple[float, float]], *inputs: Floats) -> tuple[Floats, ...]:
    """Δz, V and t of falls rod by rod; the inputs of `falls`, each of shape ``(falls,)``."""
    alpha, gamma, drop, gravity, initial_speed = inputs
    twice_g = gravity * 2.0
    arrival = np.sqrt(initial_speed * initial_speed + twice_g * drop)
    # A rod released on the contact point strikes at once, though its leg's time was 0/0.
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


def _gamma(inertia: Floats, inertia_above: Floats) -> Floats:
    """γ, Eq. 10, as `rig.model.impact.gamma_finite`."""
    return 0.25 * (1.0 + inertia) * (1.0 + 1.0 / inertia_above)


def _floats(values: ArrayLike) -> Floats:
    return np.asarray(values, dtype=np.float64)
