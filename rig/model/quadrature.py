"""Gauss–Legendre quadrature for smooth integrands on an interval."""

from functools import lru_cache
from typing import NamedTuple

from numpy.polynomial import legendre

from rig.arrays import Array


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

    nodes: Array
    weights: Array
    running: Array


@lru_cache(maxsize=64)
def gauss(count: int) -> GaussRule:
    """Return the Gauss–Legendre rule of `count` nodes with its matrix of running integrals.

    The matrix comes from the expansion in Legendre polynomials, ∫P_k = (P_{k+1} − P_{k−1})/(2k+1),
    which loses no digits as `count` grows.
    """
    nodes, weights = legendre.leggauss(count)
    values = legendre.legvander(nodes, count)  # P_0 … P_count at the nodes
    steps = values[:, 2:] - values[:, :-2]  # (2k+1) ∫P_k from −1, for k = 1 … count − 1
    running = 0.5 * weights * (1.0 + nodes[:, None] + steps @ values[:, 1:-1].T)
    for array in (nodes, weights, running):
        array.flags.writeable = False  # cached arrays are shared
    return GaussRule(nodes, weights, running)
