"""A chain's way down as a function of everything that is unknown about it, with derivatives.

The path is ballistic between impacts (section III.D): the same legs as in `rig.model.fall`, but
with release time, start, gravity, the relative gain at each impact and the place of each rod all
free, and with the derivative by each of them carried along.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

RELEASE, START, GRAVITY = 0, 1, 2
"""Columns of every trajectory's derivatives: release time, start height, acceleration."""
COMMON = 3


@dataclass(frozen=True, slots=True)
class Trajectory:
    """Legs of a fall. Leg 0 begins at the release, leg k + 1 at the impact of rod k.

    Attributes
    ----------
    time, height, speed
        At the beginning of each leg; speed after the impact, downward positive; shape ``(legs,)``.
    d_time, d_height, d_speed
        Their derivatives by release time, start, gravity and further parameters, shape
        ``(legs, parameters)``.
    arrival, d_arrival
        Speed just before the last impact with its derivatives; zero where nothing was struck.
    gravity
        m/s².
    """

    time: Array
    height: Array
    speed: Array
    d_time: Array
    d_height: Array
    d_speed: Array
    gravity: float
    arrival: float
    d_arrival: Array

    def heights(self, times: Array) -> tuple[Array, Array]:
        """Height of the reference point and its speed (downward positive), shape of `times`."""
        leg, since = self._legs(times)
        height = self.height[leg] - (self.speed[leg] + 0.5 * self.gravity * since) * since
        return height, self.speed[leg] + self.gravity * since

    def derivatives(self, times: Array) -> Array:
        """Derivatives of the height at fixed times, shape ``(times, parameters)``."""
        leg, since = self._legs(times)
        speed = self.speed[leg] + self.gravity * since
        found: Array = (
            self.d_height[leg]
            - self.d_speed[leg] * since[:, None]
            + self.d_time[leg] * speed[:, None]
        )
        found[:, GRAVITY] -= 0.5 * since * since
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


def free_trajectory(release: float, start: float, gravity: float) -> Trajectory:
    """Free fall from rest."""
    d_time, d_height, d_speed = (np.zeros((1, COMMON)) for _ in range(3))
    d_time[0, RELEASE] = d_height[0, START] = 1.0
    return Trajectory(
        np.array([release]),
        np.array([start]),
        np.zeros(1),
        d_time,
        d_height,
        d_speed,
        gravity,
        0.0,
        np.zeros(COMMON),
    )


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
    size = COMMON + 2 * rods
    time, height, speed = [release], [start], [0.0]
    d_time, d_height, d_speed = (np.zeros((rods + 1, size)) for _ in range(3))
    d_time[0, RELEASE] = d_height[0, START] = 1.0
    d_height[np.arange(1, rods + 1), COMMON + rods + np.arange(rods)] = -1.0
    arrival, d_arrival = 0.0, np.zeros(size)
    above, sign = START, 1.0  # the place at which a leg begins, and how its height follows it
    for k, (gain, ratio, place) in enumerate(
        zip(gains.tolist(), ratios.tolist(), places.tolist(), strict=True)
    ):
        below = COMMON + rods + k
        distance = height[k] + place
        arrival = math.sqrt(speed[k] ** 2 + 2.0 * gravity * max(distance, 0.0))
        # Few parameters change a leg's length: the sparse terms are added one by one.
        by_length = gravity / arrival
        d_arrival = (speed[k] / arrival) * d_speed[k]
        d_arrival[above] += sign * by_length
        d_arrival[below] += by_length
        d_arrival[GRAVITY] += distance / arrival
        both = speed[k] + arrival
        d_time[k + 1] = d_time[k] - (2.0 * distance / both**2) * (d_speed[k] + d_arrival)
        d_time[k + 1, above] += sign * 2.0 / both
        d_time[k + 1, below] += 2.0 / both
        factor = 1.0 + gain * ratio
        d_speed[k + 1] = factor * d_arrival
        d_speed[k + 1, COMMON + k] += arrival * ratio
        time.append(time[k] + 2.0 * distance / both)
        height.append(-place)
        speed.append(arrival * factor)
        above, sign = below, -1.0
    return Trajectory(
        np.array(time),
        np.array(height),
        np.array(speed),
        d_time,
        d_height,
        d_speed,
        gravity,
        arrival,
        d_arrival,
    )
