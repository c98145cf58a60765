"""Limits of the continuum fall that have closed forms: Eqs. 15 and S17, no pull, no gravity."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp

from rig.model.continuum import UniformChain, end, separation_leading_order
from tests.examples import examples
from tests.model.chains import ALPHAS, close, decades

LENGTHS = decades(-3, 3)


RATIOS = decades(-15, 9)
GRAVITIES = decades(-6, 3)


def printed_15(alpha, length, reach):
    with mp.workdps(60):
        a, rho = mp.mpf(alpha), mp.mpf(reach) / mp.mpf(length)
        root = mp.sqrt(1 + rho)
        braces = root * mp.log((root + 1) ** 2 / rho) - (1 + rho) * mp.log(1 + 1 / rho) - 1
        return float(2 * a * braces * mp.mpf(length))


def printed_s17(alpha, length, reach):
    with mp.workdps(60):
        a, rho = mp.mpf(alpha), mp.mpf(reach) / mp.mpf(length)
        braces = 1 - (rho / (1 + rho)) ** a
        return float((a / (1 + a) - rho * braces / (1 + a)) * mp.mpf(length))


@examples(150)
@given(ALPHAS, LENGTHS, RATIOS)
def test_equation_15_keeps_its_digits(alpha, length, ratio):
    reach = ratio * length
    found = separation_leading_order(alpha, length, reach)
    assert close(found, printed_15(alpha, length, reach), 1e-14)


@examples(60)
@given(LENGTHS, RATIOS, ALPHAS, decades(-3, 3), st.sampled_from([0.0, 0.18]))
def test_without_gravity_it_is_equation_s17(length, ratio, alpha, start, drop):
    reach = ratio * length
    found = end(UniformChain(length, reach, alpha, 1.0, drop, 0.0, start))
    assert close(found.separation_m, printed_s17(alpha, length, reach), 1e-13)
    assert close(found.speed_m_s, start * (1 + length / reach) ** alpha, 1e-13)
    # Paths: the free chain goes on at its speed.
    assert length - found.lay_down_s * start == pytest.approx(
        found.separation_m, abs=1e-12 * length
    )
    assert found.time_s == pytest.approx(found.lay_down_s + drop / start, rel=1e-14)


@examples(60)
@given(LENGTHS, ALPHAS, st.one_of(st.just(0.0), decades(-6, 3)), GRAVITIES)
def test_without_an_end_effect_the_end_is_infinitely_fast(length, alpha, drop, gravity):
    """The speed diverges as γs → 0, but Δz and t do not: they settle."""
    limit = end(UniformChain(length, 0.0, alpha, 1.0, drop, gravity))
    assert limit.speed_m_s == math.inf
    near = end(UniformChain(length, length * 1e-25, alpha, 1.0, drop, gravity))
    assert near.speed_m_s < math.inf
    assert close(near.separation_m, limit.separation_m, 1e-13)
    assert close(near.time_s, limit.time_s, 1e-13)
