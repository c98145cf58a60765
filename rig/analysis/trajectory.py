"""Trajectories of chains as functions of their parameters, with derivatives.

Between impacts the path is ballistic (section III.D), or that of g − κv² in air: the same legs as
in `rig.model.fall` and `rig.model.drag`. Parameters are release time, start height, gravity, κ,
α at each impact and the place of each rod. The same functions take a single fall or an array of
falls of the same chain.
"""

from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from rig.analysis.distributions import special
from rig.analysis.free_flight import (
    fall_for,
    fall_slopes,
    lasting,
    reach_of,
    reach_slopes,
    some_air,
    speed_slope,
)
from rig.arrays import Array, Index

ONE = np.ones(1)
NAMES = "release", "start", "gravity", "drag"
COMMON = len(NAMES)
RELEASE, START, GRAVITY, DRAG = range(COMMON)
"""Columns of every trajectory's derivatives: release time, start height, acceleration, κ."""
_STILL = float(np.finfo(float).eps)
"""Least share of its speed that a chain keeps at an impact: trial steps may give less than 0."""
_FAINT = 1e-3
"""Least probability of a leg that counts."""


class Hits(NamedTuple):
    """The impacts of a fall, shape ``(…, rods)`` each.

    Attributes
    ----------
    distance
        Distance fallen since the previous impact, m.
    arrival
        Speed just before the impact, m/s.
    gain
        Relative gain of speed ΔV/V.
    ratio
        ΔV/V for α = 1.
    """

    distance: Array
    arrival: Array
    gain: Array
    ratio: Array


class Slopes(NamedTuple):
    """Derivatives of each leg's start and of the last arrival, by parameters or other unknowns."""

    time: Array
    height: Array
    speed: Array
    arrival: Array


@dataclass(frozen=True)
class Trajectory:
    """Legs of a fall, or of many. Leg 0 begins at the release, leg k + 1 at the impact of rod k.

    Attributes
    ----------
    time, height, speed
        At the beginning of each leg; speed after the impact, downward positive; shape ``(legs,)``,
        or ``(falls, legs)``.
    gravity
        m/s²; for many falls shape ``(falls, 1)``.
    hits
        The impacts; `None` for a free fall.
    kappa
        κ of the air, 1/m, shaped like `gravity`; may be negative in a trial step of a fit.
    air
        κ of each leg in units of `kappa`, shape ``(legs,)``; ``(1,)`` if all are equal.
    """

    time: Array
    height: Array
    speed: Array
    gravity: float | Array
    hits: Hits | None = None
    kappa: float | Array = 0.0
    air: Array = field(default_factory=lambda: ONE)

    @property
    def arrival(self) -> float:
        """Speed just before the last impact, m/s; zero for a free fall."""
        return 0.0 if self.hits is None else float(self.hits.arrival[-1])

    def heights(self, times: Array) -> tuple[Array, Array]:
        """Return the height of the reference point and its speed (downward positive), m and m/s.

        Parameters
        ----------
        times
            Shape ``(times,)``; for many falls also ``(falls, times)``.
        """
        leg, since = self._legs(times)
        fallen, speed, _ = fall_for(since, self.speed.take(leg), self.gravity, self.kappas(leg))
        return self.height.take(leg) - fallen, speed

    def sights(
        self, times: Array, by: Array | None = None, strike_u: Array | None = None
    ) -> tuple[Array, Array, Array]:
        """Return heights and speeds as `heights` does, and derivatives of the height.

        Parameters
        ----------
        times
            As in `heights`.
        by
            Derivatives of the parameters by other unknowns, shape ``(parameters, others)``.
        strike_u
            Standard uncertainty of each rod's strike height, m, shape ``(rods,)``. Derivatives near
            a strike are then averaged over both legs, weighted by their probabilities: those of a
            single leg are wrong for a step across the strike.

        Returns
        -------
        height, speed, derivatives
            m, m/s; the last has the shape ``(…, times, parameters)``, or ``(…, times, others)``.
        """
        leg, since = self._legs(times)
        slopes = self.slopes if by is None else self.slopes_by(by)
        flight = self.gravity, self.kappas(leg)
        begin = self.speed.take(leg)
        fall = fallen, speed, by_speed = fall_for(since, begin, *flight)
        by_gravity, by_kappa = fall_slopes(since, begin, fall, *flight)
        time, height, faster = (part.reshape(-1, part.shape[-1]) for part in slopes[:3])
        # In place: these are the largest arrays of a fit.
        moved = time.take(leg, axis=0)
        moved *= speed[..., None]
        part = height.take(leg, axis=0)
        moved += part
        faster.take(leg, axis=0, out=part, mode="clip")
        part *= by_speed[..., None]
        moved -= part
        pulls = self._every if by is None else by
        pulled = np.flatnonzero(pulls[[GRAVITY, DRAG]].any(axis=0))
        pull = np.stack([by_gravity, by_kappa * self.shares(leg)], axis=-1)
        moved[..., pulled] -= pull @ pulls[[GRAVITY, DRAG]][:, pulled]
        if strike_u is not None and self.hits is not None:
            strikes, legs = self.time[..., 1:], self.time.shape[-1]
            rod = np.abs(times[..., None] - strikes[..., None, :]).argmin(axis=-1)  # the nearest
            off = speed * (np.take_along_axis(strikes, rod, -1) - times) / strike_u[rod]
            other = np.sign(off) * special().ndtr(-np.abs(off))
            near = np.nonzero(np.abs(other) > _FAINT)
            # Moving a strike in time shifts the later path by its gain of speed.
            gained = self.speed[..., 1:] - self.hits.arrival
            kicks = other * np.take_along_axis(gained, rod, -1)
            strike = (leg - leg % legs + rod + 1)[near]
            moved[near] += kicks[near][:, None] * time[strike]
        return self.height.take(leg) - fallen, speed, moved

    def passages(self, heights: Array) -> tuple[Array, Array]:
        """Return when the reference point passes each height, s, and its speed, m/s.

        For heights above the start, the time is that of the release.
        """
        leg = self._last_before(-self.height, -heights)
        kappa, speed = self.kappas(leg), self.speed.take(leg)
        # A trial step may put a rod's strike above that of the rod before.
        reach = reach_of(np.maximum(self.height.take(leg) - heights, 0.0), kappa)
        arrival = np.sqrt(np.maximum((1.0 - kappa * reach) * speed**2 + self.gravity * reach, 0.0))
        lasted = lasting(reach, speed, arrival, self.gravity, kappa)
        return self.time.take(leg) + lasted, arrival

    def times(self, heights: Array) -> Array:
        """Return when the reference point passes each height, s; see `passages`."""
        return self.passages(heights)[0]

    def squares(self, levels: Array) -> tuple[Array, Array, Array]:
        """Return the squared speeds of the reference point at some levels.

        Returns
        -------
        squares, slopes, steeper
            m²/s²; derivatives by the parameters, shape ``(levels, parameters)``; and derivatives
            by the distance fallen, m/s².
        """
        begins = -self.height[: max(1, self.height.size - 1)]
        leg = np.maximum(np.searchsorted(begins, -levels, side="left") - 1, 0)
        kappa, share, distance = self.kappas(leg), self.shares(leg), self.height[leg] - levels
        reach = reach_of(distance, kappa)
        begin, remaining = self.speed[leg], 1.0 - kappa * reach
        squares = np.maximum(remaining * begin**2 + self.gravity * reach, np.finfo(float).tiny)
        steeper = 2.0 * (self.gravity - kappa * squares)
        slopes = (2.0 * remaining * begin)[:, None] * self.slopes.speed[leg]
        slopes += steeper[:, None] * self.slopes.height[leg]
        slopes[:, GRAVITY] += reach
        slopes[:, DRAG] += share * _by_kappa(distance, reach, begin, self.gravity, kappa)
        return squares, slopes, steeper

    def kappas(self, leg: Index) -> float | Array:
        """Return κ on each of these legs, 1/m; a single number if all legs have the same."""
        return some_air(self.kappa * self.shares(leg))

    def shares(self, leg: Index) -> float | Array:
        """Return `air` of each of these legs; a single number if all legs have the same."""
        return float(self.air[0]) if self.air.size == 1 else self.air.take(leg, mode="wrap")

    def loose(self, times: Array) -> Array:
        """Return 1/M at each time, with M rods still falling; 0 before the first strike."""
        if self.hits is None:
            return np.zeros(times.shape)
        legs = self.time.shape[-1]
        struck = self._last_before(self.time, times) % legs
        falling: Array = np.maximum(legs - 1 - struck, 1)
        return np.where(struck > 0, 1.0 / falling, 0.0)

    def _legs(self, times: Array) -> tuple[Index, Array]:
        """Return each fall's leg at each time, as a flat index, and the time since it began, s."""
        leg = self._last_before(self.time, times)
        return leg, np.maximum(times - self.time.take(leg), 0.0)

    def _last_before(self, begins: Array, moments: Array) -> Index:
        """Return the last leg that has begun, as a flat index over all falls' legs."""
        begun = (begins[..., None, :] <= np.asarray(moments)[..., None]).sum(axis=-1)
        first = begins.shape[-1] * np.arange(begins.size // begins.shape[-1])
        legs: Index = np.maximum(begun - 1, 0) + (first[:, None] if begins.ndim > 1 else 0)
        return legs

    @property
    def _every(self) -> Array:
        return np.eye(COMMON if self.hits is None else COMMON + 2 * self.hits.gain.shape[-1])

    @cached_property
    def slopes(self) -> Slopes:
        """Derivatives by all parameters, computed on first use."""
        return self.slopes_by(self._every)

    def slopes_by(self, by: Array) -> Slopes:
        """Return derivatives by other unknowns, given `by` of shape ``(parameters, others)``.

        Squared speeds before and after each impact are E_k and f_k²·E_k; with q_k = e^(−2κd_k),
        E_k = q_k·f²_{k−1}·E_{k−1} + g·(1 − q_k)/κ. Derivatives follow the same recursion with
        another term for each leg.
        """
        common = by[:COMMON]
        if self.hits is None:
            nothing = np.zeros((*self.time.shape, by.shape[1]))
            return Slopes(
                nothing + common[RELEASE], nothing + common[START], nothing, nothing[..., 0, :]
            )
        gain, places = by[COMMON:].reshape(2, -1, by.shape[1])
        distance, arrival, gains, ratio = self.hits
        row = np.arange(arrival.shape[-1])
        kappa, share = self.kappas(row), self.shares(row)
        factor = 1.0 + gains
        d_factor = ratio[:, None] * gain
        d_height = np.concatenate([common[[START]], -places])
        ways = d_height[:-1] - d_height[1:]
        reach = reach_of(distance, kappa)
        remaining, begin = 1.0 - kappa * reach, self.speed[..., :-1]
        by_kappa = share * _by_kappa(distance, reach, begin, self.gravity, kappa)
        added = (2.0 * (self.gravity - kappa * arrival**2))[..., None] * ways
        added += reach[..., None] * common[GRAVITY] + by_kappa[..., None] * common[DRAG]
        kicked = 2.0 * remaining[..., 1:] * (factor * arrival**2)[..., :-1]
        added[..., 1:, :] += kicked[..., None] * d_factor[:-1]
        d_arrival = _sum_legs(remaining, factor, added) / (2.0 * arrival)[..., None]
        d_speed = np.zeros((*self.time.shape, by.shape[1]))
        d_speed[..., 1:, :] = factor[..., None] * d_arrival + arrival[..., None] * d_factor
        # The duration of a leg follows from its distance.
        lasted = np.diff(self.time)
        by_speed = speed_slope(lasted, distance, self.gravity, kappa)
        fall = distance, arrival, by_speed
        by_gravity, by_kappa = fall_slopes(lasted, begin, fall, self.gravity, kappa)
        legs = ways - by_speed[..., None] * d_speed[..., :-1, :]
        legs -= by_gravity[..., None] * common[GRAVITY]
        legs -= (share * by_kappa)[..., None] * common[DRAG]
        legs /= arrival[..., None]
        d_time = np.zeros_like(d_speed)
        np.cumsum(legs, axis=-2, out=d_time[..., 1:, :])
        d_time += common[RELEASE]
        return Slopes(
            d_time, np.broadcast_to(d_height, d_speed.shape), d_speed, d_arrival[..., -1, :]
        )


def _by_kappa(
    distance: Array, reach: Array, speed: Array, gravity: float | Array, kappa: float | Array
) -> Array:
    """Return the derivative of the squared speed at the end of a leg by its κ."""
    rest = 1.0 - kappa * reach
    slope: Array = gravity * reach_slopes(distance, reach, kappa) - 2.0 * distance * rest * speed**2
    return slope


def _sum_legs(remaining: Array, factor: Array, added: Array) -> Array:
    """Solve the recursion E_k = remaining_k·factor²_{k−1}·E_{k−1} + added_k.

    Parameters
    ----------
    remaining, factor
        Share of a squared speed that drag leaves at the end of a leg, and the factor of speed at
        its impact; shape ``(…, rods)``.
    added
        Term of each leg, shape ``(…, rods)`` or ``(…, rods, others)``.
    """
    product = np.ones_like(factor)
    np.cumprod(remaining[..., 1:] * factor[..., :-1] ** 2, axis=-1, out=product[..., 1:])
    product = np.maximum(product, np.finfo(float).tiny)
    if added.ndim > product.ndim:
        return product[..., None] * np.cumsum(added / product[..., None], axis=-2)
    return np.asarray(product * np.cumsum(added / product, axis=-1))


def free_trajectory(
    release: float | Array,
    start: float | Array,
    gravity: float | Array,
    kappa: float | Array = 0.0,
    air: Array = ONE,
) -> Trajectory:
    """Return the free fall of a chain from rest; arguments as in `struck_trajectory`."""
    height = start + np.zeros(1)
    zero = np.zeros_like(height)
    return Trajectory(release + zero, height, zero, gravity, kappa=kappa, air=air)


def struck_trajectory(
    release: float | Array,
    start: float | Array,
    gravity: float | Array,
    gains: Array,
    ratios: Array,
    places: Array,
    kappa: float | Array = 0.0,
    air: Array = ONE,
) -> Trajectory:
    """Return the fall of a chain whose rods strike the surface in turn, or many such falls.

    Parameters
    ----------
    release, start, gravity
        s, m, m/s²; for many falls shape ``(falls, 1)``.
    gains
        α of each impact, shape ``(rods,)`` or ``(falls, rods)``.
    ratios
        ΔV/V at each impact for α = 1: m/(M + γm) of Eq. 9, 0 for the top rod; shape ``(rods,)``.
    places
        Height of each rod's middle above the reference point, shaped like `gains`.
    kappa, air
        κ of the air, 1/m, and of each leg in its units, as in `Trajectory`.

    Returns
    -------
    Trajectory
        Its parameters are the `COMMON` first, then α of each rod, then the place of each rod.
    """
    gain = np.maximum(gains * ratios, _STILL - 1.0)
    height = np.empty((*gain.shape[:-1], gain.shape[-1] + 1))
    height[..., :1], height[..., 1:] = start, -places
    distance = height[..., :-1] - height[..., 1:]
    kappas = some_air(kappa * (float(air[0]) if air.size == 1 else air[: gain.shape[-1]]))
    reach, factor = reach_of(distance, kappas), 1.0 + gain
    squares = _sum_legs(1.0 - kappas * reach, factor, gravity * reach)
    arrival = np.sqrt(np.maximum(squares, 0.0))
    speed, time = np.zeros_like(height), np.zeros_like(height)
    speed[..., 1:] = factor * arrival
    lasted = lasting(reach, speed[..., :-1], arrival, gravity, kappas)
    np.cumsum(lasted, axis=-1, out=time[..., 1:])
    hits = Hits(distance, arrival, gain, ratios)
    return Trajectory(release + time, height, speed, gravity, hits, kappa, air)
