"""A chain's way down as a function of everything that is unknown about it, with derivatives.

Between impacts the path is ballistic (section III.D), or that of g − κv² in air: the same legs as
in `rig.model.fall` and `rig.model.drag`, but with release time, start, gravity, κ, the relative
gain at each impact and the place of each rod all free, and with the derivative by each of them on
request.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.analysis.free_flight import (
    fall_for,
    fall_through,
    lasting,
    leg_slopes,
    reach_of,
    reach_slopes,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Index = NDArray[np.intp]

ONE = np.ones(1)
COMMON = 4
RELEASE, START, GRAVITY, DRAG = range(COMMON)
"""Columns of every trajectory's derivatives: release time, start height, acceleration, κ."""


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
    kappa
        κ of the air, 1/m; what an adjustment tries may be negative.
    air
        κ of each leg in units of `kappa`, shape ``(legs,)``; of one element where all are alike.
    """

    time: Array
    height: Array
    speed: Array
    gravity: float
    hits: Hits | None = None
    kappa: float = 0.0
    air: Array = field(default_factory=lambda: ONE)

    @property
    def arrival(self) -> float:
        """Speed just before the last impact, m/s; zero where nothing is struck."""
        return 0.0 if self.hits is None else float(self.hits.arrival[-1])

    def heights(self, times: Array) -> tuple[Array, Array]:
        """Height of the reference point and its speed (downward positive), shape of `times`."""
        leg, since = self._legs(times)
        fallen, speed = fall_for(since, self.speed[leg], self.gravity, self.kappas(leg))
        return self.height[leg] - fallen, speed

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
        return self.sights(times, by)[2]

    def sights(self, times: Array, by: Array | None = None) -> tuple[Array, Array, Array]:
        """What `heights` and `derivatives` say, with every leg gone through once."""
        leg, since = self._legs(times)
        slopes = self.slopes
        fallen, speed, by_speed, by_gravity, by_kappa = leg_slopes(
            since, self.speed[leg], self.gravity, self.kappas(leg)
        )
        pull = by_gravity, by_kappa * self.shares(leg)
        pulls = np.zeros((2, slopes.time.shape[1]))  # by gravity and by κ
        pulls[0, GRAVITY] = pulls[1, DRAG] = 1.0
        begin = [slopes.time, slopes.height, slopes.speed]
        if by is not None:
            begin, pulls = [one @ by for one in begin], by[[GRAVITY, DRAG]]
        # In place: these are the largest arrays of an adjustment.
        found = begin[0].take(leg, axis=0)
        found *= speed[:, None]
        part = begin[1].take(leg, axis=0)
        found += part
        begin[2].take(leg, axis=0, out=part, mode="clip")
        part *= by_speed[:, None]
        found -= part
        pulled = np.flatnonzero(pulls.any(axis=0))
        found[:, pulled] -= np.stack(pull, axis=1) @ pulls[:, pulled]
        return self.height[leg] - fallen, speed, found

    def times(self, heights: Array) -> Array:
        """When the reference point comes down to each height, s; the release for higher ones."""
        leg = np.searchsorted(-self.height, -heights, side="right") - 1
        leg = np.maximum(leg, 0)
        distance = np.maximum(self.height[leg] - heights, 0.0)
        _, lasted = fall_through(distance, self.speed[leg], self.gravity, self.kappas(leg))
        found: Array = self.time[leg] + lasted
        return found

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
        reach, by_kappa = reach_slopes(distance, kappa)
        begin, left = self.speed[leg], 1.0 - kappa * reach
        squares = np.maximum(left * begin**2 + self.gravity * reach, np.finfo(float).tiny)
        steeper = 2.0 * (self.gravity - kappa * squares)
        slopes = (2.0 * left * begin)[:, None] * self.slopes.speed[leg]
        slopes += steeper[:, None] * self.slopes.height[leg]
        slopes[:, GRAVITY] += reach
        slopes[:, DRAG] += share * (self.gravity * by_kappa - 2.0 * distance * left * begin**2)
        return squares, slopes, steeper

    def kappas(self, leg: Index) -> float | Array:
        """κ on each of some legs; one number where it is the same on all."""
        return self.kappa * self.shares(leg)

    def shares(self, leg: Index) -> float | Array:
        """`air` of some legs, likewise."""
        return float(self.air[0]) if self.air.size == 1 else self.air[leg]

    def loose(self, times: Array) -> Array:
        """How loose the chain is at each time: 1/M for M rods that still fall, 0 if none struck."""
        if self.hits is None:
            return np.zeros(times.shape)
        struck = np.searchsorted(self.time[1:], times, side="left")
        left: Array = np.maximum(self.time.size - 1 - struck, 1)
        return np.where(struck > 0, 1.0 / left, 0.0)

    def _legs(self, times: Array) -> tuple[NDArray[np.intp], Array]:
        leg = np.maximum(np.searchsorted(self.time, times, side="right") - 1, 0)
        return leg, np.maximum(times - self.time[leg], 0.0)

    @cached_property
    def slopes(self) -> Slopes:
        """All derivatives; whoever only asks where the chain is does without them."""
        if self.hits is None:
            time, height, speed = (np.zeros((1, COMMON)) for _ in range(3))
            time[0, RELEASE] = height[0, START] = 1.0
            return Slopes(time, height, speed, np.zeros(COMMON))
        return _struck_slopes(self)


def free_trajectory(
    release: float, start: float, gravity: float, kappa: float = 0.0, air: Array = ONE
) -> Trajectory:
    """Fall from rest of a chain that strikes nothing; arguments as in `Trajectory`."""
    return Trajectory(
        np.array([release]), np.array([start]), np.zeros(1), gravity, kappa=kappa, air=air
    )


def struck_trajectory(
    release: float,
    start: float,
    gravity: float,
    gains: Array,
    ratios: Array,
    places: Array,
    kappa: float = 0.0,
    air: Array = ONE,
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
    kappa, air
        κ of the air, 1/m, and of each leg in its units, as in `Trajectory`.

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
    kappas = kappa * (float(air[0]) if air.size == 1 else air[:rods])
    reach = reach_of(distance, kappas)
    # Each leg needs the speed after the one before: a loop over floats is quicker than numpy here.
    speed, speeds, arrivals = 0.0, [0.0], []
    legs = np.stack([1.0 - kappas * reach, gravity * reach, 1.0 + gain], axis=1).tolist()
    for left, gained, factor in legs:
        arrival = math.sqrt(max(left * speed * speed + gained, 0.0))
        # What an adjustment tries may throw the chain back up: no chain does.
        speed = arrival * max(factor, 1e-3)
        speeds.append(speed)
        arrivals.append(arrival)
    begins, ends = np.array(speeds), np.array(arrivals)
    lasted = lasting(reach, begins[:-1], ends, gravity, kappas)
    time = np.cumsum(np.concatenate([[release], lasted]))
    hits = Hits(distance, ends, gain, ratios)
    return Trajectory(time, height, begins, gravity, hits, kappa, air)


def _struck_slopes(path: Trajectory) -> Slopes:
    """Derivatives of a struck chain's legs.

    With squared speeds E_k before and f_k²·E_k after each impact, and q_k = e^(−2κd_k),
    E_k = q_k·f²_{k−1}·E_{k−1} + g·(1 − q_k)/κ: its derivatives are sums of those of single legs,
    each times the product of q f² from there on.
    """
    hits, gravity, speed = path.hits, path.gravity, path.speed
    assert hits is not None
    rods = hits.distance.size
    size = COMMON + 2 * rods
    row = np.arange(rods)
    kappa, share = path.kappas(row), path.shares(row)
    places, gain = COMMON + rods + row, COMMON + row
    factor, arrival = 1.0 + hits.gain, hits.arrival
    left = np.exp(-2.0 * kappa * hits.distance)
    # In row k and column j of the product: what is left at impact k of E_j.
    steps = np.ones((rods, rods))
    kept = left[1:] * factor[:-1] ** 2
    steps[1:] = np.where(row[1:, None] > row, kept[:, None], 1.0)
    product = np.tril(np.cumprod(steps, axis=0))
    steeper = 2.0 * (gravity - kappa * arrival**2)  # of E, by the way
    alone = np.zeros((rods, size))
    alone[0, START] = steeper[0]
    alone[:, GRAVITY], by_kappa = reach_slopes(hits.distance, kappa)
    alone[:, DRAG] = share * (gravity * by_kappa - 2.0 * hits.distance * left * speed[:-1] ** 2)
    alone[row, places] = steeper
    alone[row[1:], places[:-1]] = -steeper[1:]
    alone[row[1:], gain[:-1]] = left[1:] * (2.0 * factor * arrival**2 * hits.ratio)[:-1]
    d_arrival = (product @ alone) / (2.0 * arrival)[:, None]
    d_speed = np.zeros((rods + 1, size))
    d_speed[1:] = factor[:, None] * d_arrival
    d_speed[1 + row, gain] += arrival * hits.ratio
    d_height = np.zeros((rods + 1, size))
    d_height[0, START] = 1.0
    d_height[1 + row, places] = -1.0
    # A leg lasts until its way is done.
    lasted = np.diff(path.time)
    _, _, by_speed, by_gravity, by_kappa = leg_slopes(lasted, speed[:-1], gravity, kappa)
    legs = np.zeros((rods + 1, size))
    legs[0, RELEASE] = 1.0
    legs[1:] = d_height[:-1] - d_height[1:] - by_speed[:, None] * d_speed[:-1]
    legs[1:, GRAVITY] -= by_gravity
    legs[1:, DRAG] -= share * by_kappa
    legs[1:] /= arrival[:, None]
    return Slopes(np.cumsum(legs, axis=0), d_height, d_speed, d_arrival[-1])
