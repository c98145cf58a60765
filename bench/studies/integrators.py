"""Other ways to follow a resolved chain step by step, to hold the leapfrog against."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from sim.resolved.compiled import jit
from sim.resolved.fall import skip
from sim.resolved.hanging import hang
from sim.resolved.motion import LONGEST, SAMPLE, act_here, drift

if TYPE_CHECKING:
    from collections.abc import Callable

    from sim.resolved.motion import World
    from sim.resolved.scene import Chain, Numbers

    Follow = Callable[[World, float, float], None]

# What these call is compiled elsewhere, so they may not be kept.
_anew = partial(jit, keep=False)


def strike(chain: Chain, follow: Follow, step: float) -> tuple[float, float]:
    """Let a chain fall until its top rod strikes: when, s, and how high it is then, m."""
    world = hang(chain)
    follow(world, skip(chain, world, step).size * SAMPLE * step, step)
    return float(world.record.touched[-1]), float(world.record.height[-1])


@jit
def _slopes(world: World) -> Numbers:
    """Rates of place, axis, velocity and spin; shape (4, N, 3)."""
    bodies = world.bodies
    found = np.zeros((4, bodies.mass.size, 3))
    for k in range(bodies.mass.size):
        found[0, k] = bodies.velocity[k]
        turning, axis = bodies.spin[k] / bodies.across[k], bodies.axis[k]
        for c in range(3):
            after, last = (c + 1) % 3, (c + 2) % 3
            found[1, k, c] = turning[after] * axis[last] - turning[last] * axis[after]
        found[2, k] = bodies.force[k] / bodies.mass[k]
        found[3, k] = bodies.torque[k]
    return found


@_anew
def euler(world: World, begin: float, step: float) -> None:
    """Semi-implicit Euler: velocities by the forces here, then places by these velocities."""
    bodies = world.bodies
    for n in range(int((LONGEST - begin) / step)):
        act_here(world, begin + n * step, step)
        for k in range(bodies.mass.size):
            bodies.velocity[k] += step / bodies.mass[k] * bodies.force[k]
        bodies.spin[:] += step * bodies.torque
        drift(bodies, step)
        if world.record.touched[-1] < math.inf:
            return


@_anew
def runge_kutta(world: World, begin: float, step: float) -> None:
    """The classical method of fourth order."""
    bodies = world.bodies
    now = np.zeros((4, bodies.mass.size, 3))
    for n in range(int((LONGEST - begin) / step)):
        now[0], now[1] = bodies.place, bodies.axis
        now[2], now[3] = bodies.velocity, bodies.spin
        change = np.zeros_like(now)
        for stage in range(4):
            ahead = (0.0, 0.5, 0.5, 1.0)[stage] * step
            act_here(world, begin + n * step + ahead, step)
            slopes = _slopes(world)
            change += (1.0, 2.0, 2.0, 1.0)[stage] / 6.0 * slopes
            after = now + (0.5, 0.5, 1.0, 0.0)[stage] * step * slopes
            if stage == 3:
                after = now + step * change
            bodies.place[:], bodies.axis[:] = after[0], after[1]
            bodies.velocity[:], bodies.spin[:] = after[2], after[3]
        for k in range(bodies.mass.size):
            bodies.axis[k] /= math.sqrt((bodies.axis[k] ** 2).sum())
        if world.record.touched[-1] < math.inf:
            return
