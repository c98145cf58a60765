"""Many falls at once: arrays in, arrays out, the same numbers as one fall at a time.

Every step is that of `rig.model.fall.fall`, in its order, so that with the same α and γ not a bit
differs. α itself rests on numpy's sine and cosine, which may differ from the C library's in the
last digit; near a singular Eq. 13 that digit weighs more.

Nothing is raised and no warning given. Where a single fall has no answer (it raises, or its answer
is not finite) the results are `NaN` and `valid` is False; nowhere else is there a `NaN`. Beyond the
model's domain, results are computed as they are for a single fall, and `in_domain` is False.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import prod
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rig.model.chain import UNIFORM_ROD_INERTIA
from rig.model.fall import LARGE, SMALL

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import ArrayLike

    from rig.model.surface import Pile

Floats: TypeAlias = NDArray[np.float64]
Flags: TypeAlias = NDArray[np.bool_]

# Falls that pass all rods together. A dozen arrays of so many stay in the second-level cache, and
# one is long enough that numpy's time for a call does not count.
_BLOCK = 8192
# Numbers of a profile that differ from fall to fall have to stay there too: rods × falls.
_PROFILE_BLOCK = 4 * _BLOCK
_NO_SIZE = -(2**30)  # the power of two of nothing


@dataclass(frozen=True, slots=True)
class Impacts:
    """Coefficients of Eq. 9; every array has the shape to which the inputs broadcast.

    Attributes
    ----------
    alpha, gamma
        `NaN` where not `valid`.
    valid
        False where `rig.model.impact` gives no finite α and γ, Eq. 13 being singular.
    in_domain
        True where `valid` and `rig.model.impact.impact_on` has nothing to note.
    sliding
        False where f = μN does not hold, the incline being below arctan μ.
    """

    alpha: Floats
    gamma: Floats
    valid: Flags
    in_domain: Flags
    sliding: Flags


@dataclass(frozen=True, slots=True)
class FallBatch:
    """The ends of falls; every array has the shape to which the inputs broadcast.

    Attributes
    ----------
    separation_m, speed_m_s, time_s
        Δz, V and t as in `rig.model.fall.Fall`; `NaN` where not `valid`.
    valid
        False where there is no such fall: no α, or the top rod never arrives.
    in_domain
        True where `valid` and the impacts are in their domain.
    """

    separation_m: Floats
    speed_m_s: Floats
    time_s: Floats
    valid: Flags
    in_domain: Flags


def given_impacts(alpha: ArrayLike, gamma: ArrayLike = 0.0) -> Impacts:
    """Coefficients that are simply given, as for a bead chain; the two broadcast."""
    arrays = _floats(alpha), _floats(gamma)
    shape = np.broadcast_shapes(*(one.shape for one in arrays))
    alphas, gammas = (np.array(_flat(one, shape)) for one in arrays)
    return _impacts(alphas, gammas, np.ones(alphas.size, np.bool_), shape)


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
    arrays = [_floats(one) for one in (incline_deg, restitution, friction, inertia)]
    # NaN stands for what was not given, since all arrays are cut into blocks alike.
    arrays += [_floats(np.nan if one is None else one) for one in (inertia_z, gamma)]
    shape = np.broadcast_shapes(*(one.shape for one in arrays))
    flat = [_flat(one, shape) for one in arrays]
    alphas, gammas = np.empty(prod(shape)), np.empty(prod(shape))
    sliding = np.empty(prod(shape), np.bool_)
    with np.errstate(all="ignore"):
        for block in _blocks(alphas.size, _BLOCK):
            theta_deg, beta, mu, xi, xi_z, given = (one[block] for one in flat)
            level = theta_deg == 0.0
            if pile is not None:
                piled = theta_deg < pile.below_deg
                beta = np.where(piled, pile.restitution.value, beta)
                level |= piled
            eq_10 = _gamma(xi, xi)
            gammas[block] = eq_10 if gamma is None else given
            free_rod = eq_10 if inertia_z is None else _gamma(xi, xi_z)
            # As in rig.model.impact.alpha_inclined: Eq. 13 × (cos θ + μ sin θ), and cos θ that
            # keeps its digits near 90°, where there is no pull.
            sin = np.sin(np.radians(theta_deg))
            cos = np.sin(np.radians(90.0 - theta_deg))
            g = cos + free_rod * sin * (sin - mu * cos) / (cos + mu * sin)
            g[~((g > 0.0) & np.isfinite(g))] = np.nan
            eq_8 = (1.0 + beta) / 4.0 * (1.0 - xi)
            inclined = np.where(cos == 0.0, 0.0, eq_8 * cos / g)
            alphas[block] = np.where(level, eq_8, inclined)
            sliding[block] = level | (theta_deg >= np.degrees(np.arctan(mu)))
    return _impacts(alphas, gammas, sliding, shape)


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
        As in `rig.model.chain.Chain`, bottom up. Shape ``(rods,)`` for one chain, or
        ``(..., rods)`` where ``...`` broadcasts with the other arguments, as in ``(falls, rods)``.
    impacts
        From `surface_impacts` or `given_impacts`.
    drop, gravity, initial_speed
        As in `rig.model.fall.hits`: m, m/s² and m/s.
    """
    chain = _floats(masses), _floats(heights)
    arrays = impacts.alpha, impacts.gamma, *map(_floats, (drop, gravity, initial_speed))
    shape = np.broadcast_shapes(*(one.shape for one in arrays), *(one.shape[:-1] for one in chain))
    flat = [_flat(one, shape) for one in arrays]
    mass, height = (_profile(one, shape) for one in chain)
    common = mass.ndim == height.ndim == 1
    length = _BLOCK if common else max(1, _PROFILE_BLOCK // len(height))
    found = np.empty((3, prod(shape)))
    room = np.empty((5, length))
    with np.errstate(all="ignore"):
        for block in _blocks(prod(shape), length):
            end = found[:, block]
            march = _March(*(one[block] for one in flat), *end, *room[:, : end.shape[1]])
            march.through(_cut(mass, block), _cut(height, block))
    valid: Flags = np.logical_and.reduce(np.isfinite(found))
    found[:, ~valid] = np.nan
    in_domain = valid & np.broadcast_to(impacts.in_domain, shape).reshape(-1)
    separation, speed, time = (one.reshape(shape) for one in found)
    return FallBatch(separation, speed, time, valid.reshape(shape), in_domain.reshape(shape))


@dataclass(slots=True)
class _March:
    """A block of falls on their way from rod to rod; every array is of shape ``(falls,)``."""

    alpha: Floats
    gamma: Floats
    drop: Floats
    gravity: Floats
    initial_speed: Floats
    # Results, written in place.
    separation: Floats
    arrival: Floats
    time: Floats
    # Room to work in.
    speed: Floats
    gained: Floats
    twice_g: Floats
    one: Floats
    other: Floats

    def through(self, mass: Floats, height: Floats) -> None:
        """All legs and impacts; masses and heights of shape ``(rods,)`` or ``(rods, falls)``."""
        size = height[-1] + self.drop, self.gravity, np.abs(self.initial_speed)
        if not all(((one > SMALL) & (one < LARGE)).all() for one in size[:2]) or (
            (size[2] >= LARGE).any()
        ):
            self._through_rescaled(mass, height, *size)
            return
        self._through(mass, height)

    def _through_rescaled(
        self, mass: Floats, height: Floats, span: Floats, gravity: Floats, speed: Floats
    ) -> None:
        """The same in units of each fall's own size, as in `rig.model.fall.fall`."""
        length = np.frexp(span)[1]
        fallen = np.where(gravity == 0.0, _NO_SIZE, (np.frexp(gravity)[1] + length) // 2)
        unit = np.maximum(fallen, np.where(speed == 0.0, _NO_SIZE, np.frexp(speed)[1]))
        unit[unit == _NO_SIZE] = 0
        self.drop = np.ldexp(self.drop, -length)
        self.gravity = np.ldexp(self.gravity, length - 2 * unit)
        self.initial_speed = np.ldexp(self.initial_speed, -unit)
        each = height if height.ndim > 1 else height[:, np.newaxis]
        self._through(mass, np.ldexp(each, -length))
        np.ldexp(self.separation, length, out=self.separation)
        np.ldexp(self.arrival, unit, out=self.arrival)
        np.ldexp(self.time, length - unit, out=self.time)

    def _through(self, mass: Floats, height: Floats) -> None:
        self.speed[:] = self.initial_speed
        for array in (self.separation, self.time, self.gained):
            array.fill(0.0)
        np.multiply(self.gravity, 2.0, out=self.twice_g)
        first = height[0] + self.drop
        self._leg(first)
        # A rod released on the contact point strikes at once, though its leg's time was 0/0.
        still = first == 0.0
        if still.any():
            self.arrival[still] = self.speed[still]
            self.time[still] = self.separation[still] = 0.0
        # Summed from the top, as in rig.model.fall.kicks.
        above = np.cumsum(mass[:0:-1], axis=0)[::-1]
        for m, rest, gap in zip(mass[:-1], above, np.diff(height, axis=0), strict=True):
            self._impact(m, rest)
            self._leg(gap)

    def _leg(self, distance: Floats | np.float64) -> None:
        """Free fall over a distance."""
        one, other = self.one, self.other
        np.multiply(self.speed, self.speed, out=one)
        np.multiply(self.twice_g, distance, out=other)
        np.add(one, other, out=one)
        np.sqrt(one, out=self.arrival)
        np.add(self.speed, self.arrival, out=one)
        np.divide(2.0 * distance, one, out=one)
        np.add(self.time, one, out=self.time)
        np.multiply(self.gained, one, out=one)
        np.add(self.separation, one, out=self.separation)

    def _impact(self, mass: Floats | np.float64, above: Floats | np.float64) -> None:
        """A rod's impact, Eq. 9: ΔV = V α m / (M + γ m)."""
        one, other = self.one, self.other
        np.multiply(self.gamma, mass, out=one)
        np.add(one, above, out=one)
        np.multiply(self.alpha, mass, out=other)
        np.divide(other, one, out=one)
        np.multiply(self.arrival, one, out=one)
        np.add(self.gained, one, out=self.gained)
        np.add(self.arrival, one, out=self.speed)


def _gamma(inertia: Floats, inertia_above: Floats) -> Floats:
    """γ, Eq. 10, as `rig.model.impact.gamma_finite`."""
    return 0.25 * (1.0 + inertia) * (1.0 + 1.0 / inertia_above)


def _impacts(alpha: Floats, gamma: Floats, sliding: Flags, shape: tuple[int, ...]) -> Impacts:
    """Put `NaN` where there is no answer, and say where the domain ends."""
    valid = np.isfinite(alpha) & np.isfinite(gamma)
    alpha[~valid] = gamma[~valid] = np.nan
    in_domain = valid & sliding & (alpha >= 0.0) & (alpha <= 0.5)
    return Impacts(
        alpha.reshape(shape),
        gamma.reshape(shape),
        valid.reshape(shape),
        in_domain.reshape(shape),
        sliding.reshape(shape),
    )


def _floats(values: ArrayLike) -> Floats:
    return np.asarray(values, dtype=np.float64)


def _flat(values: Floats, shape: tuple[int, ...]) -> Floats:
    """One number a fall; a number that all falls share is not repeated in memory."""
    return np.broadcast_to(values, shape).reshape(-1)


def _profile(values: Floats, shape: tuple[int, ...]) -> Floats:
    """One number a rod, shape ``(rods,)``, or each fall's own, shape ``(rods, falls)``."""
    if values.ndim == 1:
        return values
    rods = values.shape[-1]
    return np.broadcast_to(values, (*shape, rods)).reshape(-1, rods).T


def _cut(profile: Floats, block: slice) -> Floats:
    """Return a block's part of a profile, each rod's numbers side by side in memory."""
    return profile if profile.ndim == 1 else np.ascontiguousarray(profile[:, block])


def _blocks(size: int, length: int) -> Iterator[slice]:
    for start in range(0, size, length):
        yield slice(start, min(start + length, size))
