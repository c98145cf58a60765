"""Ways down of chains as functions of everything that is unknown about them, with derivatives.

Between impacts the path is ballistic (section III.D), or that of g − κv² in air: the same legs as
in `rig.model.fall` and `rig.model.drag`, but with release time, start, gravity, κ, the relative
gain at each impact and the place of each rod all free, and with the derivative by each of them on
request. One routine serves one fall and many falls of one chain at once.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.analysis.free_flight import (
    fall_for,
    fall_slopes,
    lasting,
    reach_of,
    reach_slopes,
    some_air,
    speed_slope,
)

if TYPE_CHECKING:
    from rig.arrays import Array, Index


ONE = np.ones(1)
COMMON = 4
RELEASE, START, GRAVITY, DRAG = range(COMMON)
"""Columns of every trajectory's derivatives: release time, start height, acceleration, κ."""
_NO_LESS = 1e-3
"""Share of its speed that an impact leaves a chain: adjustments try to throw it back up."""

_NORMAL = math.sqrt(2.0 / math.pi)
"""Slope of a normal distribution's error function, which a tanh follows to two in a hundred."""
_FAINT = 1e-3
"""Probability of a leg below which it does not count."""


class Hits(NamedTuple):
    """The impacts of a fall, shape ``(…, rods)`` each.

    Attributes
    ----------
    distance
        How far the chain fell since the impact before, m.
    arrival
        Speed just before, m/s.
    gain
        ΔV/V.
    ratio
        ΔV/V for α = 1.
    """

    distance: Array
    arrival: Array
    gain: Array
    ratio: Array


class Slopes(NamedTuple):
    """Derivatives of a trajectory by its parameters, see `Trajectory`, or by anything else."""

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
        m/s²; of many falls shape ``(falls, 1)``.
    hits
        `None` where nothing is struck.
    kappa
        κ of the air, 1/m, likewise; what an adjustment tries may be negative.
    air
        κ of each leg in units of `kappa`, shape ``(legs,)``; of one element where all are alike.
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
        """Speed just before the last impact, m/s; zero where nothing is struck."""
        return 0.0 if self.hits is None else float(self.hits.arrival[-1])

    def heights(self, times: Array) -> tuple[Array, Array]:
        """Height of the reference point and its speed (downward positive).

        Parameters
        ----------
        times
            Shape ``(times,)``; of many falls also ``(falls, times)``.
        """
        leg, since = self._legs(times)
        fallen, speed, _ = fall_for(since, self.speed.take(leg), self.gravity, self.kappas(leg))
        return self.height.take(leg) - fallen, speed

    def sights(
        self, times: Array, by: Array | None = None, strike_u: Array | None = None
    ) -> tuple[Array, Array, Array]:
        """What `heights` says, and derivatives of the height, with every leg gone through once.

        Parameters
        ----------
        times
            As in `heights`.
        by
            Derivatives of the parameters by anything else, shape ``(parameters, others)``.
        strike_u
            How well it is known at which height each rod strikes, m, shape ``(rods,)``. Derivatives
            near a strike are then means of those of both legs, each as likely as it is: those of
            one leg hold for no step across the strike.

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
        # In place: these are the largest arrays of an adjustment.
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
            strikes = self.time[1:]
            rod = np.abs(times[:, None] - strikes).argmin(axis=1)  # whose strike is the nearest
            off = speed * (strikes[rod] - times) / strike_u[rod]
            other = 0.5 * (np.sign(off) - np.tanh(_NORMAL * off))
            near = np.flatnonzero(np.abs(other) > _FAINT)
            # A strike lowers the chain by what it makes it faster, times how long ago it was.
            kicks = other * (self.speed[1:] - self.hits.arrival)[rod]
            moved[near] += kicks[near, None] * time[rod[near] + 1]
        return self.height.take(leg) - fallen, speed, moved

    def passages(self, heights: Array) -> tuple[Array, Array]:
        """When the reference point comes down to each height, s, and how fast, m/s.

        It is at higher ones at the release.
        """
        leg = self._last_before(-self.height, -heights)
        kappa, speed = self.kappas(leg), self.speed.take(leg)
        # An adjustment may try a rod that strikes above where the one before it did.
        reach = reach_of(np.maximum(self.height.take(leg) - heights, 0.0), kappa)
        arrival = np.sqrt(np.maximum((1.0 - kappa * reach) * speed**2 + self.gravity * reach, 0.0))
        lasted = lasting(reach, speed, arrival, self.gravity, kappa)
        return self.time.take(leg) + lasted, arrival

    def times(self, heights: Array) -> Array:
        """When the reference point comes down to each height, s; the release for higher ones."""
        return self.passages(heights)[0]

    def squares(self, levels: Array) -> tuple[Array, Array, Array]:
        """Squares of the speeds with which the reference point comes down to some levels.

        Returns
        -------
        squares, slopes, steeper
            m²/s²; derivatives by the parameters, shape ``(levels, parameters)``; and by the way,
            m/s².
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
        """κ on each of some legs; one number where it is the same on all."""
        return some_air(self.kappa * self.shares(leg))

    def shares(self, leg: Index) -> float | Array:
        """`air` of some legs, likewise."""
        return float(self.air[0]) if self.air.size == 1 else self.air.take(leg, mode="wrap")

    def loose(self, times: Array) -> Array:
        """How loose the chain is at each time: 1/M for M rods that still fall, 0 if none struck."""
        if self.hits is None:
            return np.zeros(times.shape)
        struck = np.searchsorted(self.time[1:], times, side="left")
        falling: Array = np.maximum(self.time.size - 1 - struck, 1)
        return np.where(struck > 0, 1.0 / falling, 0.0)

    def _legs(self, times: Array) -> tuple[Index, Array]:
        """On which leg each fall is at each time, in the line of all legs, and for how long."""
        leg = self._last_before(self.time, times)
        return leg, np.maximum(times - self.time.take(leg), 0.0)

    def _last_before(self, begins: Array, moments: Array) -> Index:
        """Return the last leg that has begun, in the line of all falls' legs."""
        if begins.ndim == 1:
            return np.maximum(np.searchsorted(begins, moments, side="right") - 1, 0)
        count, size = begins.shape
        moments_of = np.broadcast_to(moments, (count, moments.shape[-1]))
        legs = np.zeros(moments_of.shape, dtype=np.intp)
        for row, (begin, moment) in enumerate(zip(begins, moments_of, strict=True)):
            last = np.searchsorted(begin, moment, side="right") - 1
            legs[row] = size * row + np.maximum(last, 0)
        return legs

    @property
    def _every(self) -> Array:
        return np.eye(COMMON if self.hits is None else COMMON + 2 * self.hits.gain.shape[-1])

    @cached_property
    def slopes(self) -> Slopes:
        """All derivatives; whoever only asks where the chain is does without them."""
        return self.slopes_by(self._every)

    def slopes_by(self, by: Array) -> Slopes:
        """Derivatives by anything that parameters depend on, shape ``(parameters, others)``.

        Squared speeds before and after each impact are E_k and f_k²·E_k; with q_k = e^(−2κd_k),
        E_k = q_k·f²_{k−1}·E_{k−1} + g·(1 − q_k)/κ, and so are its derivatives but for what each leg
        adds.
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
        factor = _factors(gains)
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
        d_arrival = _carried(remaining, factor, added) / (2.0 * arrival)[..., None]
        d_speed = np.zeros((*self.time.shape, by.shape[1]))
        d_speed[..., 1:, :] = factor[..., None] * d_arrival + arrival[..., None] * d_factor
        # A leg lasts until its way is done.
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
    """Derivative of the squared speed at the end of a leg by its κ."""
    rest = 1.0 - kappa * reach
    slope: Array = gravity * reach_slopes(distance, reach, kappa) - 2.0 * distance * rest * speed**2
    return slope


def _factors(gains: Array) -> Array:
    """By what factor impacts make a chain faster."""
    return np.maximum(1.0 + gains, _NO_LESS)


def _carried(remaining: Array, factor: Array, added: Array) -> Array:
    """Sum up what each leg adds to a squared speed, and what is left of all legs before.

    Parameters
    ----------
    remaining, factor
        What is left of it at the end of a leg, and by what factor an impact makes a chain faster;
        shape ``(…, rods)``.
    added
        Shape ``(…, rods)`` or ``(…, rods, others)``.
    """
    product = np.ones_like(factor)
    np.cumprod(remaining[..., 1:] * factor[..., :-1] ** 2, axis=-1, out=product[..., 1:])
    product = np.maximum(product, np.finfo(float).tiny)
    if added.ndim > product.ndim:
        return product[..., None] * np.cumsum(added / product[..., None], axis=-2)
    carried: Array = product * np.cumsum(added / product, axis=-1)
    return carried


def free_trajectory(
    release: float,
    start: float | Array,
    gravity: float | Array,
    kappa: float | Array = 0.0,
    air: Array = ONE,
) -> Trajectory:
    """Fall from rest of a chain that strikes nothing; arguments as in `struck_trajectory`."""
    height = start + np.zeros(1)
    zero = np.zeros_like(height)
    return Trajectory(release + zero, height, zero, gravity, kappa=kappa, air=air)


def struck_trajectory(
    release: float,
    start: float | Array,
    gravity: float | Array,
    gains: Array,
    ratios: Array,
    places: Array,
    kappa: float | Array = 0.0,
    air: Array = ONE,
) -> Trajectory:
    """Fall of a chain whose rods strike the surface one after another, or many such falls.

    Parameters
    ----------
    start, gravity
        m, m/s²; of many falls shape ``(falls, 1)``.
    gains
        α of each impact, shape ``(rods,)`` or ``(falls, rods)``.
    ratios
        ΔV/V at each impact for α = 1: m/(M + γm) of Eq. 9, 0 for the top rod; shape ``(rods,)``.
    places
        Height of each rod's middle above the reference point, shape ``(rods,)``.
    kappa, air
        κ of the air, 1/m, and of each leg in its units, as in `Trajectory`.

    Returns
    -------
    Trajectory
        Its parameters are the common ones, then α of each rod, then the place of each rod.
    """
    gain = gains * ratios
    height = np.empty((*gain.shape[:-1], gain.shape[-1] + 1))
    height[..., :1], height[..., 1:] = start, -places
    distance = height[..., :-1] - height[..., 1:]
    kappas = some_air(kappa * (float(air[0]) if air.size == 1 else air[: len(places)]))
    reach, factor = reach_of(distance, kappas), _factors(gain)
    squares = _carried(1.0 - kappas * reach, factor, gravity * reach)
    arrival = np.sqrt(np.maximum(squares, 0.0))
    speed, time = np.zeros_like(height), np.zeros_like(height)
    speed[..., 1:] = factor * arrival
    lasted = lasting(reach, speed[..., :-1], arrival, gravity, kappas)
    np.cumsum(lasted, axis=-1, out=time[..., 1:])
    hits = Hits(distance, arrival, gain, ratios)
    return Trajectory(release + time, height, speed, gravity, hits, kappa, air)
