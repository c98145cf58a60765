"""How a little drag changes a fall: the derivative by κ of g − κv² at κ = 0."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rig.analysis.trajectory import Trajectory

    Array = NDArray[np.float64]


def slowed(path: Trajectory, times: Array) -> Array:
    """Derivative of the height by κ at fixed times, m², shape of `times`.

    Between impacts the way η and the speed ν that κ adds obey ν' = −v² and η' = ν. A rod strikes at
    a fixed place, so an impact that multiplies the speed by f takes η to fη, and ν to
    fν − (f − 1) g η/v.

    Parameters
    ----------
    path
        Of either chain; one κ holds for all its legs, as it does where all rods are alike.
    times
        When the height is wanted, s, shape ``(times,)``.
    """
    gravity = path.gravity
    way, speed = np.zeros(path.time.size), np.zeros(path.time.size)
    for k in range(path.time.size - 1):
        lasted = path.time[k + 1] - path.time[k]
        more_way, more_speed = _leg(path.speed[k], gravity, lasted)
        end_way, end_speed = way[k] + speed[k] * lasted + more_way, speed[k] + more_speed
        before = path.speed[k] + gravity * lasted
        factor = path.speed[k + 1] / before
        way[k + 1] = factor * end_way
        speed[k + 1] = factor * end_speed - (factor - 1.0) * gravity * end_way / before
    leg = np.maximum(np.searchsorted(path.time, times, side="right") - 1, 0)
    since = np.maximum(times - path.time[leg], 0.0)
    found: Array = -(way[leg] + speed[leg] * since + _leg(path.speed[leg], gravity, since)[0])
    return found


def _leg(speed: Array, gravity: float, time: Array) -> tuple[Array, Array]:
    """−∫∫v² and −∫v² of a leg that begins with a speed."""
    square = speed * speed
    way = (square / 2.0 + (speed * gravity / 3.0 + gravity**2 * time / 12.0) * time) * time**2
    return -way, -(square + (speed * gravity + gravity**2 * time / 3.0) * time) * time
