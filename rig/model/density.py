"""How a chain's mass may be spread along it, for Eq. 1 with the tension of Eq. 11.

All that the motion needs of a density λ(z), z counted from the chain's top end, is the pull

    α λ/(M + γm) = α/(M/λ + γs),    M(z) = ∫₀^z λ dz,    m = λs (rods an even s apart),

so that a profile is its M/λ, a length. That stays moderate where λ itself runs over any number of
decades, and no unit of mass is left in it. For an even density M/λ = z.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass, field
from itertools import accumulate, pairwise
from typing import Protocol

from rig.errors import DomainError


class Density(Protocol):
    """A density along a chain."""

    @property
    def length_m(self) -> float:
        """z₀, the chain's length."""

    @property
    def kinks(self) -> tuple[float, ...]:
        """Distances from the top end, rising, at which the density is not smooth, m."""

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

    @property
    def kinks(self) -> tuple[float, ...]:
        """None."""
        return ()

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

    @property
    def kinks(self) -> tuple[float, ...]:
        """None."""
        return ()

    def mass_over_density(self, z: float) -> float:
        """M/λ = (1 − e^−kz)/k with k = decades · ln 10/z₀."""
        rate = self.decades * math.log(10.0) / self.length_m
        return -math.expm1(-rate * z) / rate if rate else z


@dataclass(frozen=True, slots=True)
class Tabulated:
    """A density that runs straight from each of some points to the next.

    Attributes
    ----------
    distances
        From the top end, m; strictly rising from 0 to the chain's length.
    densities
        λ there, in any one unit; all above zero.
    """

    distances: tuple[float, ...]
    densities: tuple[float, ...]
    _masses: tuple[float, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        zs, values = self.distances, self.densities
        if len(zs) != len(values) or len(zs) < 2:
            raise DomainError(
                f"{len(zs)} distances and {len(values)} densities: "
                "as many of the one as of the other are wanted, at least two"
            )
        if zs[0] != 0.0 or not all(a < b < math.inf for a, b in pairwise(zs)):
            raise DomainError("distances must rise from 0, each above the one before")
        if not all(0.0 < value < math.inf for value in values):
            raise DomainError("every density must be a finite number above zero")
        pieces = (
            0.5 * (low + high) * (b - a)
            for (a, b), (low, high) in zip(pairwise(zs), pairwise(values), strict=True)
        )
        object.__setattr__(self, "_masses", tuple(accumulate(pieces, initial=0.0)))

    @property
    def length_m(self) -> float:
        """z₀, the last of the distances."""
        return self.distances[-1]

    @property
    def kinks(self) -> tuple[float, ...]:
        """The distances between the first and the last."""
        return self.distances[1:-1]

    def mass_over_density(self, z: float) -> float:
        """M/λ, both exactly those of the straight pieces."""
        zs, values = self.distances, self.densities
        i = min(bisect_right(zs, z), len(zs) - 1) - 1
        low, high, into = values[i], values[i + 1], z - zs[i]
        # From both ends: a light end beside a heavy one keeps its digits.
        here = (low * (zs[i + 1] - z) + high * into) / (zs[i + 1] - zs[i])
        return self._masses[i] / here + 0.5 * into * (1.0 + low / here)


def _check_length(length_m: float) -> None:
    if not 0.0 < length_m < math.inf:
        raise DomainError(f"length_m = {length_m:g}: a finite length above zero is wanted")
