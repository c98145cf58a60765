"""The experiment worked out by hand: 40 digits, straight from the equations, no shortcuts.

The numbers are the paper's own: 25 uniform rods over 1.165 m, 0.18 m above the contact point.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from mpmath.ctx_mp import MPContext

from rig.protocol import protocol, reader

PROTOCOLS = Path(__file__).parents[2] / "protocols"
UNIFORM = reader.read(PROTOCOLS / "inclined-uniform.yaml")
WITHOUT_GATES = replace(UNIFORM, gates=protocol.Gates())

mp = MPContext()  # of its own, so that no other test's digits change
mp.dps = 40
mpf = mp.mpf

RODS = 25
SPACING = mpf("1.165") / 24
DROP = mpf("0.18")
GRAVITY = mpf("9.81")
TILT = mp.radians(12)
WIDTH = mpf("0.0127") / mp.cos(TILT)
INERTIA = mpf(1) / 3
GAMMA = (1 + INERTIA) * (1 + 1 / INERTIA) / 4  # Eq. 10
PLACES = [DROP + k * SPACING for k in range(RODS)]
DELAY = 0.02  # of the release behind the fire stamp, by default


def alpha(incline: float, beta: str = "0.5", mu: str = "0.2", pile: str = "-0.37") -> Any:
    """Eq. 8 on the pile, which gathers below 30°, Eqs. 12 and 13 on the slope."""
    if incline < 30:
        return (1 + mpf(pile)) / 4 * (1 - INERTIA)
    theta, beta, mu = mp.radians(incline), mpf(beta), mpf(mu)
    slide = (1 - mu * mp.cot(theta)) / (1 + mu * mp.tan(theta))
    g = mp.cos(theta) ** 2 + mp.sin(theta) ** 2 * GAMMA * slide
    return (1 + beta) / 4 * (1 - INERTIA) * mp.cos(theta) ** 2 / g


class ByHand:
    """One impact chain's fall: at each hit the time, the speed before and after.

    `places` are the rods' heights above the contact point before release.
    """

    def __init__(self, alphas: list, places: list = PLACES) -> None:
        self.places = places
        self.times, self.before, self.after = [], [], []
        time = speed = mpf(0)
        for k, a in enumerate(alphas):
            distance = places[k] - (places[k - 1] if k else 0)
            arrival = mp.sqrt(speed**2 + 2 * GRAVITY * distance)
            time += (arrival - speed) / GRAVITY
            above = len(alphas) - 1 - k  # rods of one mass: m = 1, M = their number
            impulse = a * arrival / (1 + GAMMA / above) if above else 0  # Eq. 9
            speed = arrival + (impulse / above if above else 0)
            self.times.append(time)
            self.before.append(arrival)
            self.after.append(speed)

    @classmethod
    def at(cls, incline: float, places: list = PLACES, **coefficients: str) -> ByHand:
        return cls([alpha(incline, **coefficients)] * RODS, places)

    @property
    def separation(self) -> Any:
        """Δz: where the free twin's top rod is when this chain's top rod hits."""
        return self.places[-1] - GRAVITY * self.times[-1] ** 2 / 2

    def time_down(self, distance: Any) -> Any:
        """When the chain has come down by a distance since its release."""
        done = mpf(0)
        time = speed = mpf(0)
        for place, when, after in zip(self.places, self.times, self.after, strict=True):
            if distance <= place:
                break
            done, time, speed = place, when, after
        return time + (mp.sqrt(speed**2 + 2 * GRAVITY * (distance - done)) - speed) / GRAVITY


def free_time_down(distance: Any) -> Any:
    return mp.sqrt(2 * distance / GRAVITY)


def crossings(
    gate_height: float, time_down, places: list = PLACES
) -> list[tuple[float, bool, int]]:
    """(seconds since release, blocked, rod) at one beam."""
    found = []
    for k, place in enumerate(places):
        above = place - mpf(gate_height)
        if above > 0:
            found.append((float(time_down(above - WIDTH / 2)), True, k))
            found.append((float(time_down(above + WIDTH / 2)), False, k))
    return found
