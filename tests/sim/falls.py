"""The experiment worked out by hand: 40 digits, straight from the equations, no shortcuts.

The numbers are the paper's own: 25 uniform rods over 1.165 m, 0.18 m above the contact point.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from mpmath import mp

from rig.bench.references import exact_coefficients
from rig.protocol import protocol, reader
from tests.model.reference import exact_gains, exact_hits

PROTOCOLS = Path(__file__).parents[2] / "protocols"
UNIFORM = reader.read(PROTOCOLS / "inclined-uniform.yaml")
WITHOUT_GATES = replace(UNIFORM, gates=protocol.Gates())

RODS = 25
with mp.workdps(40):
    DROP, GRAVITY, INERTIA = mp.mpf("0.18"), mp.mpf("9.81"), mp.mpf(1) / 3
    WIDTH = mp.mpf("0.0127") / mp.cos(mp.radians(12))
    GAMMA = (1 + INERTIA) * (1 + 1 / INERTIA) / 4  # Eq. 10
    PLACES = [DROP + k * mp.mpf("1.165") / 24 for k in range(RODS)]
DELAY = 0.02  # of the release behind the fire stamp, by default


@mp.workdps(40)
def alpha(incline: float, beta: str = "0.5", mu: str = "0.2", pile: str = "-0.37") -> Any:
    """Eq. 8 on the pile, which gathers below 30°, Eqs. 12 and 13 on the slope."""
    if incline < 30:
        return (1 + mp.mpf(pile)) / 4 * (1 - INERTIA)
    said = {"restitution": beta, "friction": mu, "inertia": INERTIA, "incline": incline}
    return mp.mpf(exact_coefficients(said)["alpha"])


class ByHand:
    """One impact chain's fall: at each hit the time, the speed before and after.

    `places` are the rods' heights above the contact point before release.
    """

    @mp.workdps(40)
    def __init__(self, alphas: list, places: list = PLACES) -> None:
        self.places = places
        gains = exact_gains([1] * len(alphas), alphas, GAMMA)
        still = [0] * len(alphas)
        hits = exact_hits([place - DROP for place in places], gains, still, DROP, GRAVITY, 0)
        self.times, self.before, self.after = zip(*hits, strict=True)

    @classmethod
    def at(cls, incline: float, places: list = PLACES, **coefficients: str) -> ByHand:
        return cls([alpha(incline, **coefficients)] * RODS, places)

    @property
    @mp.workdps(40)
    def separation(self) -> Any:
        """Δz: where the free twin's top rod is when this chain's top rod hits."""
        return self.places[-1] - GRAVITY * self.times[-1] ** 2 / 2

    @mp.workdps(40)
    def time_down(self, distance: Any) -> Any:
        """When the chain has come down by a distance since its release."""
        done = mp.mpf(0)
        time = speed = mp.mpf(0)
        for place, when, after in zip(self.places, self.times, self.after, strict=True):
            if distance <= place:
                break
            done, time, speed = place, when, after
        return time + (mp.sqrt(speed**2 + 2 * GRAVITY * (distance - done)) - speed) / GRAVITY


@mp.workdps(40)
def free_time_down(distance: Any) -> Any:
    return mp.sqrt(2 * distance / GRAVITY)


def crossings(
    gate_height: float, time_down, places: list = PLACES
) -> list[tuple[float, bool, int]]:
    """(seconds since release, blocked, rod) at one beam."""
    found = []
    for k, place in enumerate(places):
        above = place - mp.mpf(gate_height)
        if above > 0:
            found.append((float(time_down(above - WIDTH / 2)), True, k))
            found.append((float(time_down(above + WIDTH / 2)), False, k))
    return found
