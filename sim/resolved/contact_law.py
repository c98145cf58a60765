"""How two points that touch push each other: stiffness, restitution and friction.

The force is k δ (1 + d v/v₀) for an overlap δ that grows at the rate v, with v₀ the greatest rate
of this touch (Hunt and Crossley's form, Gonthier and others' d). It begins and ends at zero,
takes energy and never gives any, and brings points back with the restitution e whatever their
masses are and at whatever speed they come.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from sim.resolved.scene import Numbers

SLOWEST = 0.05
"""v₀ is at least this, m/s: what rests must not be damped by an infinite force."""
STICKS_BELOW = 0.02
"""Friction falls to zero below this rate of slip, m/s: what should stick creeps so slowly."""
DEADEST = 0.1
"""The least restitution; d goes with 1/e, and the step that it needs with that."""


def damping(restitution: float) -> float:
    """Find d, which solves d (1 + e) = ln((1 + d)/(1 − e d)): the free bounce's first integral.

    Raises
    ------
    ValueError
        A restitution outside [`DEADEST`, 1].
    """
    e = restitution
    if not DEADEST <= e <= 1.0:
        raise ValueError(f"restitution {e} is not between {DEADEST} and 1")
    low, high = 0.0, 1.0 / e
    for _ in range(200):
        d = 0.5 * (low + high)
        spent = 1.0 - e * d
        if spent <= 0.0 or d * (1.0 + e) < math.log1p(d) - math.log(spent):
            high = d
        else:
            low = d
    return low


def push(
    overlap: Numbers, rate: Numbers, fastest: Numbers, stiffness: Numbers, d: Numbers | float
) -> tuple[Numbers, Numbers]:
    """Force of every touch, and the greatest rate so far of each.

    Parameters
    ----------
    overlap, rate
        δ in m and v in m/s; no force where δ ≤ 0.
    fastest
        What the last call gave for these touches; 0 where there was none.
    stiffness, d
        k in N/m and `damping`.
    """
    touching = overlap > 0.0
    fastest = np.maximum(np.maximum(fastest, rate), SLOWEST) * touching
    scale = 1.0 + d * rate / np.where(touching, fastest, 1.0)
    return stiffness * overlap * np.maximum(scale, 0.0) * touching, fastest


def rubbing(
    slip: Numbers, force: Numbers, friction: Numbers | float, mass: Numbers, step: float
) -> Numbers:
    """Coulomb friction against a slip; shape (3, K).

    Parameters
    ----------
    slip
        Velocity within the surface, m/s; shape (3, K).
    force
        Normal force, N.
    mass
        Of the lighter body, kg: one step must not do more than end the slip of its end.
    step
        s.
    """
    speed = np.sqrt(slip[0] * slip[0] + slip[1] * slip[1] + slip[2] * slip[2])
    most = friction * force
    # An end that can also turn and roll gives way up to six times as easily as the whole rod.
    share = most / np.maximum(np.maximum(speed, STICKS_BELOW), 6.0 * most * step / mass)
    return np.asarray(-share * slip)
