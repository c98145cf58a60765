"""A chain's way down as a function of everything that is unknown about it, with derivatives.

The path is ballistic between impacts (section III.D): the same legs as in `rig.model.fall`, but
with release time, start, gravity, the relative gain at each impact and the place of each rod all
free, and with the derivative by each of them on request.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

RELEASE, START, GRAVITY = 0, 1, 2
"""Columns of every trajectory's derivatives: release time, start height, acceleration."""
COMMON = 3


class Hits(NamedTuple):
    """The impacts of a fall, shape ``(rods,)`` each.

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
    """Derivatives of a trajectory by its parameters, see `Trajectory`."""

    time: Array
    height: Array
    speed: Array
    arrival: Array


@dataclass(frozen=True)
class Trajectory:
    """Legs of a fall. Leg 0 begins at the release, leg k + 1 at the impact of rod k.

    Attributes
    ----------
    time, height, speed
        At the beginning of each leg; speed after the impact, downward positive; shape ``(legs,)``.
    gravity
        m/s².
    hits
        `None` where nothing is struck.
    """

    time: Array
    height: Array
    speed: Array
    gravity: float
    hits: Hits | None = None

    @property
    def arrival(self) -> float:
        """Speed just before the last impact, m/s; zero where nothing is struck."""
        return 0.0 if self.hits is None else float(self.hits.arrival[-1])

    @property
    def d_time(self) -> Array:
        """Derivatives by release time, start, gravity, … , shape ``(legs, parameters)``."""
        return self._slopes.time

    @property
    def d_height(self) -> Array:
        """Derivatives likewise."""
        return self._slopes.height

    @property
    def d_speed(self) -> Array:
        """Derivatives likewise."""
        return self._slopes.speed

    @property
    def d_arrival(self) -> Array:
        """Derivatives of `arrival`, shape ``(parameters,)``."""
        return self._slopes.arrival

    def heights(self, times: Array) -> tuple[Array, Array]:
        """Height of the reference point and its speed (downward positive), shape of `times`."""
        leg, since = self._legs(times)
        speed = self.speed[leg]
        fallen = (speed + 0.5 * self.gravity * since) * since
        return self.height[leg] - fallen, speed + self.gravity * since

    def derivatives(self, times: Array, by: Array | None = None) -> Array:
        """Derivatives of the height at fixed times.

        Parameters
        ----------
        by
            Derivatives of the parameters by anything else, shape ``(parameters, others)``.

        Returns
        -------
        ndarray
            Shape ``(times, parameters)``, or ``(times, others)``.
        """
        leg, since = self._legs(times)
        slopes = self._slopes
        gravity = np.zeros(slopes.time.shape[1])
        gravity[GRAVITY] = 1.0
        begin = [slopes.time, slopes.height, slopes.speed]
        if by is not None:
            begin, gravity = [one @ by for one in begin], by[GRAVITY]
        # In place: these are the largest arrays of an adjustment.
        found = begin[0].take(leg, axis=0)
        found *= (self.speed[leg] + self.gravity * since)[:, None]
        part = begin[1].take(leg, axis=0)
        found += part
        begin[2].take(leg, axis=0, out=part, mode="clip")
        part *= since[:, None]
        found -= part
        pulled = np.flatnonzero(gravity)
        found[:, pulled] -= (0.5 * since * since)[:, None] * gravity[pulled]
        return found

    def times(self, heights: Array) -> Array:
        """When the reference point comes down to each height, s; the release for higher ones."""
        leg = np.searchsorted(-self.height, -heights, side="right") - 1
        leg = np.maximum(leg, 0)
        distance = np.maximum(self.height[leg] - heights, 0.0)
        arrival = np.sqrt(self.speed[leg] ** 2 + 2.0 * self.gravity * distance)
        sum_of_speeds = np.maximum(self.speed[leg] + arrival, np.finfo(float).tiny)
        found: Array = self.time[leg] + 2.0 * distance / sum_of_speeds
        return found

    def _legs(self, times: Array) -> tuple[NDArray[np.intp], Array]:
        leg = np.maximum(np.searchsorted(self.time, times, side="right") - 1, 0)
        return leg, np.maximum(times - self.time[leg], 0.0)

    @cached_property
    def _slopes(self) -> Slopes:
        """All derivatives; whoever only asks where the chain is does without them."""
        if self.hits is None:
            time, height, speed = (np.zeros((1, COMMON)) for _ in range(3))
            time[0, RELEASE] = height[0, START] = 1.0
            return Slopes(time, height, speed, np.zeros(COMMON))
        return _struck_slopes(self.speed, self.gravity, self.hits)


def free_trajectory(release: float, start: float, gravity: float) -> Trajectory:
    """Free fall from rest."""
    return Trajectory(np.array([release]), np.array([start]), np.zeros(1), gravity)


def struck_trajectory(
    release: float, start: float, gravity: float, gains: Array, ratios: Array, places: Array
) -> Trajectory:
    """Fall of a chain whose rods strike the surface one after another.

    Parameters
    ----------
    gains
        α of each impact, shape ``(rods,)``.
    ratios
        ΔV/V at each impact for α = 1: m/(M + γm) of Eq. 9, 0 for the top rod; shape ``(rods,)``.
    places
        Height of each rod's middle above the reference point, shape ``(rods,)``.

    Returns
    -------
    Trajectory
        Its parameters are the common ones, then α of each rod, then the place of each rod.
    """
    rods = len(places)
    gain = gains * ratios
    height = np.empty(rods + 1)
    height[0] = start
    np.negative(places, out=height[1:])
    distance = height[:-1] - height[1:]
    now, speed = release, 0.0
    time, speeds, arrivals = [now], [speed], []
    for fallen, more in zip(distance.tolist(), gain.tolist(), strict=True):
        arrival = math.sqrt(speed * speed + 2.0 * gravity * max(fallen, 0.0))
        now += 2.0 * fallen / (speed + arrival)
        speed = arrival * (1.0 + more)
        time.append(now)
        speeds.append(speed)
        arrivals.append(arrival)
    hits = Hits(distance, np.array(arrivals), gain, ratios)
    return Trajectory(np.array(time), height, np.array(speeds), gravity, hits)


def _struck_slopes(speed: Array, gravity: float, hits: Hits) -> Slopes:
    """Derivatives of a struck chain's legs.

    With squared speeds E_k before and f_k²·E_k after each impact, E_k = f²_{k−1}·E_{k−1} + 2g·d_k
    is linear: E_k = Σ_j P_kj·2g·d_j, where P_kj is the product of f² from j to k − 1.
    """
    rods = hits.distance.size
    size = COMMON + 2 * rods
    row = np.arange(rods)
    places = slice(COMMON + rods, size)
    gain, factor = COMMON + row, 1.0 + hits.gain
    arrival, squares = hits.arrival, factor * factor
    steps = np.ones((rods, rods))
    steps[1:] = np.where(row[1:, None] > row, squares[:-1, None], 1.0)
    product = np.tril(np.cumprod(steps, axis=0))
    after = np.zeros((rods, rods))
    after[:, :-1] = product[:, 1:]
    # Of E: f² − 1 as a product, for it is small where α is.
    energy = np.zeros((rods, size))
    energy[:, START] = 2.0 * gravity * product[:, 0]
    energy[:, GRAVITY] = product @ (2.0 * hits.distance)
    energy[:, COMMON : COMMON + rods] = after * (2.0 * factor * arrival**2 * hits.ratio)
    energy[:, places] = after * (2.0 * gravity * hits.gain * (factor + 1.0))
    energy[row, places.start + row] = 2.0 * gravity
    d_arrival = energy / (2.0 * arrival)[:, None]
    d_speed = np.zeros((rods + 1, size))
    d_speed[1:] = factor[:, None] * d_arrival
    d_speed[1 + row, gain] += arrival * hits.ratio
    d_height = np.zeros((rods + 1, size))
    d_height[0, START] = 1.0
    d_height[1 + row, places.start + row] = -1.0
    both = speed[:-1] + arrival
    legs = np.zeros((rods + 1, size))
    legs[0, RELEASE] = 1.0
    legs[1:] = (2.0 / both)[:, None] * (d_height[:-1] - d_height[1:])
    legs[1:] -= (2.0 * hits.distance / both**2)[:, None] * (d_speed[:-1] + d_arrival)
    return Slopes(np.cumsum(legs, axis=0), d_height, d_speed, d_arrival[-1])
