"""The ledger of energy of a fall's impacts."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rig.model.fall import hits


@dataclass(frozen=True)
class Blow:
    """One impact and its energy.

    Attributes
    ----------
    time_s, speed_m_s
        When, and the speed just before.
    impulse
        J, the pull on the chain above, in units of mass × m/s.
    brought
        Kinetic energy that the rod brings, ½mV², in units of mass × (m/s)².
    passed_on
        What the chain above gains of it: JV + J²/2M.
    """

    time_s: float
    speed_m_s: float
    impulse: float
    brought: float
    passed_on: float

    @property
    def lost(self) -> float:
        """What stays in the rod: never negative for α ≤ ½; 0 for α = ½ and a long chain."""
        return self.brought - self.passed_on


def blows(chain, gains, drop, gravity, speed=0.0):
    """Every impact with its impulse (Eq. 9) and energy, bottom rod first."""
    found = []
    for k, (hit, gain) in enumerate(
        zip(hits(chain, gains, drop, gravity, speed), gains, strict=True)
    ):
        before, upper = hit.speed_before, math.fsum(chain.masses[k + 1 :])
        step = before * gain
        impulse = upper * step
        brought = 0.5 * chain.masses[k] * before**2
        found.append(Blow(hit.time_s, before, impulse, brought, (before + 0.5 * step) * impulse))
    return found
