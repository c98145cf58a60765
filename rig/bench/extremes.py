"""Scenes at the ends of what can be asked."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from rig.model.chain import Chain
from rig.model.surface import Surface
from rig.units import Quantity

TIGHT = 1e-13
"""Relative error allowed inside the domain."""
MILLION = 1e-10
"""The same for a million rods."""
PITCH = 0.0485


@dataclass(frozen=True, slots=True)
class Extreme:
    """One scene.

    Attributes
    ----------
    group
        What is driven to its end.
    value
        How far, in words.
    alpha
        Given α instead of the surface's; `None` otherwise.
    kappa
        Of the air, 1/m, the same on every leg.
    """

    group: str
    value: str
    chain: Chain
    incline_deg: float = 40.0
    restitution: float = 0.5
    friction: float = 0.2
    drop: float = 0.18
    gravity: float = 9.81
    initial_speed: float = 0.0
    alpha: float | None = None
    kappa: float = 0.0
    allowed: float = TIGHT

    @property
    def surface(self) -> Surface:
        """The surface struck."""
        return Surface(Quantity(self.restitution), Quantity(self.friction))


def uniform(rods: int, length: float = 1.165) -> Chain:
    """Like rods at equal distances."""
    return Chain((1.0,) * rods, tuple(length * k / (rods - 1) for k in range(rods)))


def decades(ratio: float, rods: int = 25, length: float = 1.165) -> Chain:
    """Masses that change by a power of ten given over the whole chain, bottom to top."""
    exponents = [ratio * k / (rods - 1) for k in range(rods)]
    # Both ends inside the floats' own 616 decades.
    middle = 0.5 * ratio if abs(ratio) > 300 else 0.0
    return Chain(
        tuple(10.0 ** (e - middle) for e in exponents),
        tuple(length * k / (rods - 1) for k in range(rods)),
    )


PAPER = uniform(25)


def extremes() -> Iterator[Extreme]:
    """Every scene, group by group."""
    yield from _chains()
    yield from _impacts()
    yield from _falls()
    yield from _in_air()
    yield from _units()


def _chains() -> Iterator[Extreme]:
    for rods in (2, 3, 25, 1000, 10_000, 1_000_000):
        allowed = MILLION if rods >= 1_000_000 else TIGHT
        yield Extreme("rods", f"{rods}", uniform(rods), allowed=allowed)
    for power in (-12, 12, -300, 300, -600):
        yield Extreme("mass, top/bottom", f"1e{power}", decades(float(power)))
    yield Extreme("mass, top/bottom", "1e-300, 1000 rods", decades(-300.0, 1000))
    light = replace(PAPER, masses=(*PAPER.masses[:-1], 1e-300))
    yield Extreme("mass, top/bottom", "1e-300, top rod only", light)


def _impacts() -> Iterator[Extreme]:
    for alpha in (0.0, 1e-15, 1e-12, 1e-6, 0.5, 0.51):
        yield Extreme("α", f"{alpha:g}", PAPER, alpha=alpha)
    slides = math.degrees(math.atan(0.2))
    for incline in (0.0, 1e-9, 5.0, slides * 0.999, slides * 1.001, 45.0, 89.0, 90 - 1e-9, 90.0):
        yield Extreme("incline (°)", f"{incline:.11g}", PAPER, incline_deg=incline)
    for friction in (0.0, 1e-15, 0.839, 0.84, 10.0, 1e3):
        yield Extreme("friction", f"{friction:g}", PAPER, friction=friction)
    for inertia in (1e-12, 1e-3, 0.999, 1.0 - 2.0**-52, 1.0):
        yield Extreme("rod inertia ξ", f"{inertia:.17g}", replace(PAPER, inertia=inertia))
    for inertia in (1e-12, 1e-3):
        yield Extreme("rod inertia ξ_z", f"{inertia:g}", replace(PAPER, inertia_z=inertia))
    thin = replace(PAPER, inertia_z=1e-3)
    yield Extreme("rod inertia ξ_z", "0.001, at 10°", thin, incline_deg=10.0)
    for restitution in (-1.0, -1.0 + 2.0**-52, 0.0, 1.0):
        yield Extreme("restitution", f"{restitution:.17g}", PAPER, restitution=restitution)


def _falls() -> Iterator[Extreme]:
    for drop in (0.0, 1e-12, 1e6, 1e12):
        yield Extreme("drop (m)", f"{drop:g}", PAPER, drop=drop)
    for gravity in (1e-12, 1e-6, 1e6):
        yield Extreme("gravity (m/s²)", f"{gravity:g}", PAPER, gravity=gravity)
    yield Extreme("gravity (m/s²)", "0, at 1 m/s", PAPER, gravity=0.0, initial_speed=1.0)
    yield Extreme("gravity (m/s²)", "0, at rest", PAPER, gravity=0.0)


def _in_air() -> Iterator[Extreme]:
    for kappa in (1e-12, 1e-3, 0.06, 1.0, 10.0, 1000.0):
        yield Extreme("air, κ (1/m)", f"{kappa:g}", PAPER, kappa=kappa)
    yield Extreme("air, κ (1/m)", "0.06, 1000 rods", uniform(1000), kappa=0.06)
    yield Extreme("air, κ (1/m)", "0.06, mass 1e-12", decades(-12.0), kappa=0.06)
    yield Extreme("air, κ (1/m)", "0.06, α 1e-12", PAPER, alpha=1e-12, kappa=0.06)
    terminal = math.sqrt(9.81)  # of κ = 1/m
    for share in (0.5, 10.0):
        yield Extreme("air, terminal speed ×", f"{share:g}", PAPER, kappa=1.0,
                      initial_speed=share * terminal)  # fmt: skip


def _units() -> Iterator[Extreme]:
    for length in (1e-320, 1e-300, 1e-150, 1e150, 1e300):
        yield Extreme("length (m)", f"{length:g}", uniform(25, length), drop=length / 8)
    for speed in (1e-300, 1e-160, 1e160, 1e300):
        yield Extreme("initial speed (m/s)", f"{speed:g}", PAPER, initial_speed=speed)
    for gravity in (1e-320, 1e300):
        yield Extreme("gravity (m/s²)", f"{gravity:g}", PAPER, gravity=gravity)
