"""Chains for hypothesis, and how close two results must be."""

import math
from itertools import accumulate

from hypothesis import strategies as st

from rig.model.chain import Chain


def decades(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers spread evenly over the powers of ten from 10^low to 10^high."""
    return st.floats(low, high).map(lambda exponent: 10.0**exponent)


def chains(most: int = 12, mass_decades: float = 6.0) -> st.SearchStrategy[Chain]:
    def build(masses: list[float], gaps: list[float]) -> Chain:
        return Chain(tuple(masses), tuple(accumulate(gaps[: len(masses) - 1], initial=0.0)))

    masses = st.lists(decades(-mass_decades, mass_decades), min_size=2, max_size=most)
    gaps = st.lists(decades(-4, 1), min_size=most, max_size=most)
    return st.builds(build, masses, gaps)


def even_chain(rods: int, length: float = 1.165) -> Chain:
    return Chain((1.0,) * rods, tuple(length * k / (rods - 1) for k in range(rods)))


ALPHAS = decades(-12, 0)
GAMMAS = st.one_of(st.just(0.0), decades(-3, 2))
DROPS = st.one_of(st.just(0.0), decades(-6, 2))
GRAVITIES = decades(-12, 3)
SPEEDS = st.one_of(st.just(0.0), decades(-3, 3))


def close(found: float, wanted: float, relative: float) -> bool:
    """Purely relative: zero is close to nothing but zero."""
    return math.isclose(found, wanted, rel_tol=relative, abs_tol=0.0)
