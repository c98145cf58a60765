"""Dual numbers: quantities with their derivatives, carried through arithmetic.

Forward-mode automatic differentiation (Griewank and Walther 2008, chapter 3).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from rig.arrays import Array


@dataclass(frozen=True, slots=True, eq=False)
class Dual:
    """A quantity, or an array of them, to first order in the unknowns.

    Attributes
    ----------
    value
        A number, or an array of shape ``(n,)``.
    slopes
        Derivatives by all unknowns, shape ``(unknowns,)`` or ``(n, unknowns)``.
    """

    value: Any
    slopes: Array
    __array_ufunc__ = None  # an array on the left must not absorb the dual number

    def __getitem__(self, place: int) -> Dual:
        return Dual(float(self.value[place]), self.slopes[place])

    def __neg__(self) -> Dual:
        return Dual(-self.value, -self.slopes)

    def __add__(self, other: Any) -> Dual:
        if isinstance(other, Dual):
            return Dual(self.value + other.value, self.slopes + other.slopes)
        return Dual(self.value + other, self.slopes)

    __radd__ = __add__

    def __sub__(self, other: Any) -> Dual:
        return self.__add__(-other)

    def __rsub__(self, other: Any) -> Dual:
        return Dual(other - self.value, -self.slopes)

    def __mul__(self, other: Any) -> Dual:
        if isinstance(other, Dual):
            slopes = _times(self.slopes, other.value) + _times(other.slopes, self.value)
            return Dual(self.value * other.value, slopes)
        return Dual(self.value * other, _times(self.slopes, other))

    __rmul__ = __mul__

    def __truediv__(self, other: Dual) -> Dual:
        ratio = self.value / other.value
        slopes = self.slopes - _times(other.slopes, ratio)
        return Dual(ratio, _times(slopes, 1.0 / other.value))

    def along(self, other: Dual, slope: Any) -> Dual:
        """Return the quantity as a function of another one too, with its derivative by that."""
        return Dual(self.value, self.slopes + _times(other.slopes, slope))

    def root(self) -> Dual:
        """Return the square root of a positive quantity."""
        root = np.sqrt(self.value)
        return Dual(root, _times(self.slopes, 0.5 / root))


def _times(slopes: Array, factor: Any) -> Array:
    """Return the derivatives of each quantity multiplied by its own factor."""
    product: Array = slopes * np.asarray(factor)[..., None]
    return product
