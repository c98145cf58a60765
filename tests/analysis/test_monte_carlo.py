"""JCGM 101 beside the GUM budget: the same inputs, nothing linearised."""

from __future__ import annotations

import math

import pytest

from rig.analysis.monte_carlo import monte_carlo
from tests.analysis.sessions import cases, fits

TRIALS = 150


@pytest.mark.parametrize("scene", ["uniform", "single", "fence"])
def test_both_ways_agree(scene):
    """χ² of 149, once in 10⁴ each side: u within factors 0.78 and 1.23; the mean within 4 SE."""
    (fit,) = fits(cases((1,), seed=6, scene=scene))
    (one,) = cases((1,), seed=6, scene=scene)
    found = monte_carlo(fit, TRIALS, seed=1)
    quantities = one.analyze().quantities
    assert found.keys() == quantities.keys()
    for name, measured in quantities.items():
        propagated = found[name]
        assert 0.78 < propagated.u / measured.u < 1.23, name
        assert abs(propagated.mean - measured.value) < 4 * measured.u / math.sqrt(TRIALS), name
        assert propagated.low < measured.value < propagated.high


def test_a_seed_is_kept():
    (fit,) = fits(cases((1,), seed=6, scene="fence"))
    one, same, other = (monte_carlo(fit, 5, seed) for seed in (3, 3, 4))
    assert one == same != other
