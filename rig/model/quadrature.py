"""Two rules for smooth and for end-singular integrands on an interval."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.polynomial import legendre

if TYPE_CHECKING:
    from numpy.typing import NDArray

_REACH = 4.0
"""Where the tanh–sinh rule is cut off: 6e-38 of the interval is left on either side, so that even
1/√x at an end loses only 5e-19 of its integral."""


class GaussRule(NamedTuple):
    """Gauss–Legendre on (−1, 1).

    Attributes
    ----------
    nodes, weights
        Shape ``(n,)``.
    running
        Shape ``(n, n)``: ``running @ f`` is the integral from −1 to each node of the polynomial
        through the values `f` at the nodes.
    """

    nodes: NDArray[np.float64]
    weights: NDArray[np.float64]
    running: NDArray[np.float64]


class EndRule(NamedTuple):
    """A rule on (0, 1) whose nodes crowd towards both ends.

    Attributes
    ----------
    nodes
        Shape ``(n,)``, each with full relative precision also where it is close to 0.
    weights
        Shape ``(n,)``.
    """

    nodes: NDArray[np.float64]
    weights: NDArray[np.float64]


@lru_cache(maxsize=64)
def gauss(count: int) -> GaussRule:
    """Gauss–Legendre rule of `count` nodes with its matrix of running integrals.

    The matrix comes from the expansion in Legendre polynomials, ∫P_k = (P_{k+1} − P_{k−1})/(2k+1),
    which loses no digits as `count` grows.
    """
    nodes, weights = legendre.leggauss(count)
    values = legendre.legvander(nodes, count)  # P_0 … P_count at the nodes
    steps = values[:, 2:] - values[:, :-2]  # (2k+1) ∫P_k from −1, for k = 1 … count − 1
    running = 0.5 * weights * (1.0 + nodes[:, None] + steps @ values[:, 1:-1].T)
    for array in (nodes, weights, running):
        array.flags.writeable = False  # they are handed out again and again
    return GaussRule(nodes, weights, running)


@lru_cache(maxsize=64)
def tanh_sinh(count: int) -> EndRule:
    """Tanh–sinh (double exponential) rule of `count` nodes: x = 1/(1 + exp(−π sinh u))."""
    u, step = np.linspace(-_REACH, _REACH, count, retstep=True)
    fold = np.pi * np.sinh(u)
    nodes = 1.0 / (1.0 + np.exp(-fold))
    rest = 1.0 / (1.0 + np.exp(fold))  # 1 − x without taking that difference
    weights = step * np.pi * np.cosh(u) * nodes * rest
    for array in (nodes, weights):
        array.flags.writeable = False
    return EndRule(nodes, weights)
