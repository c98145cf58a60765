"""How far the continuum is from the discrete model, and how fast the two meet."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest

from rig.model.continuum import UniformChain, end
from rig.model.fall import fall
from tests.model.chains import even_chain

LENGTH, DROP, GRAVITY = 1.165, 0.18, 9.81
SPACING = LENGTH / 24


def both(alpha, gamma, rods=25, drop=DROP):
    continuum = UniformChain(LENGTH, LENGTH / (rods - 1), alpha, gamma, drop, GRAVITY)
    return continuum, fall(even_chain(rods, LENGTH), alpha, gamma, drop, GRAVITY)


def orders(errors):
    return [math.log2(abs(coarse / fine)) for coarse, fine in pairwise(errors)]


@pytest.mark.parametrize("alpha", [0.05, 0.155, 0.5])
@pytest.mark.parametrize("reach", [0.02, 0.0647, 0.5])
def test_many_rods_reach_the_continuum_at_first_order(alpha, reach):
    """γs held fixed: each rod's pull comes as one blow instead of over a spacing, ∝ 1/(N − 1)."""
    separations, speeds, times = [], [], []
    for rods in (801, 1601, 3201, 6401):
        continuum, discrete = both(alpha, reach / (LENGTH / (rods - 1)), rods)
        limit = end(continuum)
        separations.append(discrete.separation_m / limit.separation_m - 1)
        speeds.append(discrete.speed_m_s / limit.speed_m_s - 1)
        times.append(discrete.time_s / limit.time_s - 1)
    for errors in (separations, speeds, times):
        assert abs(errors[-1]) < 4e-3
        assert orders(errors)[-1] == pytest.approx(1.0, abs=0.03)


def test_from_rest_small_pulls_meet_at_order_three_halves():
    """To first order in α, Δz is a sum over rods of speed when struck × time left.

    With h = 0 both ends of that sum are 0, so that it is a trapezoidal rule; the speed, which
    starts like a square root, leaves it (N − 1)^-3/2.
    """
    errors = []
    for rods in (801, 1601, 3201, 6401):
        continuum, discrete = both(1e-9, 0.0647 / (LENGTH / (rods - 1)), rods, drop=0.0)
        errors.append(discrete.separation_m / end(continuum).separation_m - 1)
    assert orders(errors)[-1] == pytest.approx(1.5, abs=0.03)
    assert abs(errors[-1]) < 2e-6
