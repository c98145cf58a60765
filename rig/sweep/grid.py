"""A grid of parameters and the pieces into which it is cut."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator


@dataclass(frozen=True, slots=True)
class Axis:
    """One varied parameter and its values, rising or as the plan lists them.

    Attributes
    ----------
    name
        One of `rig.sweep.variables.VARIABLES`.
    values
        In SI, angles in degrees.
    """

    name: str
    values: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Grid:
    """All combinations of the axes' values; the last axis runs fastest."""

    axes: tuple[Axis, ...]

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values along each axis."""
        return tuple(len(axis.values) for axis in self.axes)

    @property
    def size(self) -> int:
        """Number of points."""
        return math.prod(self.shape)

    def chunks(self, length: int) -> Iterator[range]:
        """Cut the points, in their order, into pieces of `length`; the last may be shorter."""
        for start in range(0, self.size, length):
            yield range(start, min(start + length, self.size))


def spaced(low: float, high: float, count: int) -> tuple[float, ...]:
    """Return `count` evenly spaced numbers from `low` to `high`, both among them.

    Each is the float nearest to what a person finds by decimal arithmetic: 0 to 0.9 in nine steps
    has 0.3 and not 0.30000000000000004.

    Parameters
    ----------
    low, high
        Finite.
    count
        At least 2.
    """
    start, end = Fraction(repr(low)), Fraction(repr(high))
    step = (end - start) / (count - 1)
    return tuple(float(start + step * number) for number in range(count))
