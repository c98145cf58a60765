"""How a chain's mass may be spread along it, for Eq. 1 with the tension of Eq. 11.

All that the motion needs of a density λ(z), z counted from the chain's top end, is the pull

    α λ/(M + γm) = α/(M/λ + γs),    M(z) = ∫₀^z λ dz,    m = λs (rods an even s apart),

so that a profile is its M/λ, a length. That stays moderate where λ itself runs over any number of
decades, and no unit of mass is left in it. For an even density M/λ = z.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

from rig.errors import DomainError


class Density(Protocol):
    """A smooth density along a chain."""

    @property
    def length_m(self) -> float:
        """z₀, the chain's length."""

    def mass_over_density(self, z: float) -> float:
        """M/λ at a distance z from the top end, m; 0 at z = 0."""


def pull(density: Density, z: float, reach_m: float) -> float:
    """λ/(M + γm) where the piece at a distance z from the top end is at the surface, 1/m.

    Eq. 11 in Eq. 1 reads dV/dt = g + α · pull · V².

    Parameters
    ----------
    reach_m
        γs.
    """
    return 1.0 / (density.mass_over_density(z) + reach_m)


@dataclass(frozen=True, slots=True)
class Uniform:
    """The same density everywhere."""

    length_m: float

    def __post_init__(self) -> None:
        _check_length(self.length_m)

    def mass_over_density(self, z: float) -> float:
        """M/λ = z."""
        return z


@dataclass(frozen=True, slots=True)
class Exponential:
    """λ ∝ 10^(decades · z/z₀).

    Attributes
    ----------
    length_m
        z₀.
    decades
        Powers of ten by which the chain is heavier at its lower end; negative where lighter.
    """

    length_m: float
    decades: float

    def __post_init__(self) -> None:
        _check_length(self.length_m)
        # Upward of 300 M/λ at the lower end is no number any more; downward nothing overflows.
        if not (math.isfinite(self.decades) and self.decades >= -300.0):
            raise DomainError(f"decades = {self.decades:g}: at least -300 and finite is wanted")

    def mass_over_density(self, z: float) -> float:
        """M/λ = (1 − e^−kz)/k with k = decades · ln 10/z₀."""
        rate = self.decades * math.log(10.0) / self.length_m
        return -math.expm1(-rate * z) / rate if rate else z


def _check_length(length_m: float) -> None:
    if not 0.0 < length_m < math.inf:
        raise DomainError(f"length_m = {length_m:g}: a finite length above zero is wanted")
