"""A chain of rods: masses, heights and inertia for the mechanics."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate, pairwise

from rig.units import Quantity

XI = 4.0
"""Factor from a moment of inertia in units of m L² to ξ."""
UNIFORM_ROD_INERTIA = 1.0 / 3.0
"""ξ = 4I/(mL²) of a uniform rod about its middle (below Eq. 8)."""


@dataclass(frozen=True)  # without slots, so that `legs` can be cached
class Chain:
    """Masses and places of the rods, bottom up.

    Attributes
    ----------
    masses
        Mass of each rod in any common unit, as only ratios matter.
    heights
        Height of each rod's middle above the middle of the bottom rod, m; strictly rising from 0.
    inertia
        ξ = 4I/(mL²), the dimensionless rotational inertia of every rod (Eqs. 8 and 10).
    inertia_z
        ξ about the vertical axis if it differs from that about the horizontal axis (Eq. 13).
    alpha, gamma
        Stated impact coefficients (a bead chain); `None` to compute them from the surface by
        Eqs. 8 to 13.
    """

    masses: tuple[float, ...]
    heights: tuple[float, ...]
    inertia: float = UNIFORM_ROD_INERTIA
    inertia_z: float | None = None
    alpha: Quantity | None = None
    gamma: float | None = None

    @property
    def rods(self) -> int:
        """Number of rods."""
        return len(self.masses)

    @property
    def length(self) -> float:
        """Distance of the top rod's middle from that of the bottom rod, m."""
        return self.heights[-1]

    @cached_property
    def legs(self) -> tuple[tuple[float, float], ...]:
        """After each impact but the top rod's: the gap to the next rod, m, and M/m of Eq. 9.

        M is the mass above the rod that struck and m its own. M is summed from the top, so that a
        light end on a heavy chain keeps its digits.
        """
        above = [*accumulate(self.masses[:0:-1])][::-1]
        pairs = zip(pairwise(self.heights), above, self.masses, strict=False)
        return tuple((high - low, rest / mass) for (low, high), rest, mass in pairs)


def equal_gaps(diameters: Sequence[float], length: float) -> tuple[float, ...]:
    """Return the heights of rods with equal gaps between neighbours, bottom up, m."""
    halves = [(lower + upper) / 2 for lower, upper in pairwise(diameters)]
    gap = (length - math.fsum(halves)) / len(halves)
    # The top is set, not summed, so that the length is exactly what was stated.
    return (*accumulate((gap + half for half in halves[:-1]), initial=0.0), length)
