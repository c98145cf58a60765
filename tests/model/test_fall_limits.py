"""Limits in which the discrete fall has a closed form."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given

from rig.model.fall import fall
from tests.examples import examples
from tests.model.chains import DROPS, GAMMAS, GRAVITIES, chains, close, even_chain


@examples(80)
@given(chains(mass_decades=2), GAMMAS, DROPS, GRAVITIES)
def test_small_alpha_is_linear(chain, gamma, drop, gravity):
    """To first order rod j, struck at free-fall speed V_j, gives ΔV_j (T − t_j) of separation.

    With V = √(2 g z) and t = √(2 z/g) for a fall of z, gravity drops out.
    """
    total = drop + chain.length
    wanted = 0.0
    for j, height in enumerate(chain.heights[:-1]):
        m, rest, fallen = chain.masses[j], math.fsum(chain.masses[j + 1 :]), drop + height
        later = (chain.length - height) / (math.sqrt(total) + math.sqrt(fallen))
        wanted += 2.0 * m / (rest + gamma * m) * math.sqrt(fallen) * later
    for alpha in (1e-25, 1e-20):
        assert close(fall(chain, alpha, gamma, drop, gravity).separation_m / alpha, wanted, 1e-13)


def endless(value, orders=(1.0, 2.0, 3.0), rods=1001):
    """Value for infinitely many rods: errors ∝ (rods − 1)^-order are removed by halving steps."""
    row = [value(2**i * (rods - 1) + 1) for i in range(len(orders) + 1)]
    for order in orders:
        row = [fine + (fine - coarse) / (2**order - 1) for coarse, fine in pairwise(row)]
    return row[0]


LENGTH = 1.165


def smooth(rods, reach, **how):
    """A fall of a finely divided chain with γ s, the reach of the end effect, held at `reach`."""
    gamma = reach / (LENGTH / (rods - 1))
    return fall(even_chain(rods, LENGTH), gamma=gamma, **how)


@pytest.mark.parametrize("alpha", [0.01, 0.1, 0.25, 0.5])
@pytest.mark.parametrize("reach", [0.02, 0.06, 1.0])
@pytest.mark.parametrize("drop", [0.0, 0.18])
def test_many_rods_reach_the_speed_of_equation_14(alpha, reach, drop):
    g, z0, power = 9.81, LENGTH, 2 * alpha
    start, end = z0 + reach, reach
    braces = drop * start**power + (start ** (1 + power) - end ** (1 + power)) / (1 + power)
    wanted = math.sqrt(2 * g / end**power * braces)
    found = endless(lambda n: smooth(n, reach, alpha=alpha, drop=drop, gravity=g).speed_m_s)
    assert found == pytest.approx(wanted, rel=1e-6)


@pytest.mark.parametrize("alpha", [1e-6, 0.1, 0.5])
@pytest.mark.parametrize("reach", [0.02, 0.06, 1.0])
def test_many_rods_without_gravity_reach_the_separation_of_equation_s17(alpha, reach):
    z0 = LENGTH
    end = 1 - (reach / (z0 + reach)) ** alpha
    wanted = alpha / (1 + alpha) * z0 - reach / (1 + alpha) * end
    found = endless(
        lambda n: (
            smooth(n, reach, alpha=alpha, drop=0.18, gravity=0.0, initial_speed=3.0).separation_m
        )
    )
    assert found == pytest.approx(wanted, rel=1e-6)


@pytest.mark.parametrize("reach", [0.02, 0.06, 1.0])
def test_many_rods_at_small_alpha_reach_the_separation_of_equation_15(reach):
    ratio = reach / LENGTH
    root = math.sqrt(1 + ratio)
    braces = root * math.log((root + 1) ** 2 / ratio) - (1 + ratio) * math.log1p(1 / ratio) - 1
    found = endless(
        lambda n: smooth(n, reach, alpha=1e-9, drop=0.0, gravity=9.81).separation_m,
        orders=(1.5, 2.0),  # from rest the speed starts like a square root
    )
    wanted = 2e-9 * LENGTH * braces
    assert found == pytest.approx(wanted, rel=1e-6)
