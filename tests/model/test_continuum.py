"""The continuum fall against many digits, and limits with closed forms: Eqs. 15 and S17."""

from dataclasses import replace
from decimal import Decimal

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp

from rig.bench.references import continuum, many_digits
from rig.errors import DomainError
from rig.model.continuum import UniformChain, end, end_speed, separation_leading_order
from rig.model.quadrature import gauss
from tests.examples import examples
from tests.model.chains import ALPHAS, close, decades
from tests.refusals import refused
from tests.tables import cases

# A sum of some hundred positive terms, each of a dozen roundings; 4e-15 is the worst seen.
TIGHT = 1e-13

REACHES = st.one_of(st.just(0.0), decades(-15, 6))
DROPS = st.one_of(st.just(0.0), decades(-15, 9))
GRAVITIES = decades(-6, 3)
SPEEDS = st.one_of(st.just(0.0), decades(-6, 4))
RATIOS = decades(-15, 9)
PAPER = UniformChain(1.165, 1.165 / 24, 0.15506060850816171, 4 / 3, 0.18, 9.81)


def chain_of(length, reach, alpha, drop, gravity, initial_speed=0.0):
    """γ = 1, so that the reach is given to the last digit."""
    return UniformChain(length, reach, alpha, 1.0, drop, gravity, initial_speed)


@examples(150)
@given(decades(-3, 3), REACHES, ALPHAS, DROPS, GRAVITIES, SPEEDS)
def test_agrees_with_the_closed_form(length, reach, alpha, drop, gravity, initial_speed):
    found = end(chain_of(length, reach, alpha, drop, gravity, initial_speed))
    with many_digits():  # it falls as from the height at which it would have been at rest
        height = Decimal(drop) + Decimal(initial_speed) ** 2 / (2 * Decimal(gravity))
        wanted = continuum(length, reach, alpha, height, gravity, digits=120)
        lay_down = wanted["time"] - (2 * height / Decimal(gravity)).sqrt()
    assert close(found.lay_down_s, lay_down, TIGHT)
    assert close(found.speed_m_s, wanted["speed"], TIGHT)
    assert close(found.separation_m, wanted["separation"], TIGHT)


@examples(150)
@given(decades(-3, 3), REACHES, ALPHAS | st.just(0.0), DROPS, GRAVITIES, SPEEDS)
def test_the_speed_at_the_end_is_equation_14(length, reach, alpha, drop, gravity, initial_speed):
    found = end_speed(chain_of(length, reach, alpha, drop, gravity, initial_speed))
    with mp.workdps(60):
        z0, r, a, h, g, v = map(mp.mpf, (length, reach, alpha, drop, gravity, initial_speed))
        braces = (h + v * v / (2 * g)) * (z0 + r) ** (2 * a)
        braces += ((z0 + r) ** (1 + 2 * a) - r ** (1 + 2 * a)) / (1 + 2 * a)
        wanted = mp.sqrt(2 * g / r ** (2 * a) * braces) if r or not a else mp.inf
    assert close(found, float(wanted), 1e-14)


@cases
def test_says_what_is_wrong_with_a_chain(change, message):
    refused(DomainError, message, replace, PAPER, **change)


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
@given(ALPHAS, decades(-3, 3), RATIOS)
def test_equation_15_keeps_its_digits(alpha, length, ratio):
    reach = ratio * length
    found = separation_leading_order(alpha, length, reach)
    assert close(found, printed_15(alpha, length, reach), 1e-14)


@examples(60)
@given(decades(-3, 3), RATIOS, ALPHAS, decades(-3, 3), st.sampled_from([0.0, 0.18]))
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


def test_rules_are_shared_and_cannot_be_spoilt():
    assert gauss(7) is gauss(7)
    with pytest.raises(ValueError, match="read-only"):
        gauss(7).weights[0] = 0.0
