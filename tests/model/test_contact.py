"""Impacts that last: against two many-digit solutions, and towards the discrete fall as τ → 0."""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import pairwise

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from mpmath import mp

from rig.errors import DomainError
from rig.model.chain import Chain
from rig.model.contact import _SERIES, _ramp, _risen, contact_fall
from rig.model.fall import fall, free_fall_speed, hits, kicks
from rig.model.impact import alpha_inclined, gamma_finite
from tests.examples import examples
from tests.model.chains import (
    ALPHAS,
    DROPS,
    GAMMAS,
    GRAVITIES,
    SPEEDS,
    chains,
    close,
    decades,
    even_chain,
)
from tests.model.contact_reference import (
    exponential_fall,
    response,
    speed_of_response,
    superposed_fall,
    way_of_response,
)

TIGHT = 1e-13
CONTACTS = decades(-9, -2)
DROP, GRAVITY = 0.18, 9.81
PAPERS = even_chain(25)
GAMMA = gamma_finite(1 / 3)


def gains_at(incline_deg):
    return kicks(PAPERS, [alpha_inclined(0.5, 0.2, incline_deg)] * 25, GAMMA)


def assert_close(end, wanted, relative=TIGHT):
    assert close(end.separation_m, wanted.separation, relative)
    assert close(end.speed_m_s, wanted.speed, relative)
    assert close(end.time_s, wanted.time, relative)


@pytest.mark.parametrize("tau", [1e-9, 3e-4, 0.7])
def test_the_response_brings_all_of_the_pull_with_a_mean_delay_of_one_contact_time(tau):
    with mp.workdps(30):
        tau = mp.mpf(tau)
        parts = [0, tau, 5 * tau, 20 * tau, 60 * tau]
        assert abs(mp.quad(lambda t: response(t, tau), parts) - 1) < 1e-25
        assert abs(mp.quad(lambda t: t * response(t, tau), parts) / tau - 1) < 1e-25
        for end in (tau / 50, tau, 7 * tau):
            speed = mp.quad(lambda t: response(t, tau), [0, end])
            way = mp.quad(lambda t, end=end: (end - t) * response(t, tau), [0, end])
            assert abs(speed_of_response(end, tau) / speed - 1) < 1e-20
            assert abs(way_of_response(end, tau) / way - 1) < 1e-20


@pytest.mark.parametrize("tau", [1e-9, 1e-2])
def test_the_references_agree_to_fifty_digits(tau):
    chain = even_chain(5)
    case = (chain.heights, kicks(chain, [0.2] * 5, GAMMA), DROP, GRAVITY, tau)
    one, other = superposed_fall(*case, digits=90), exponential_fall(*case)
    with mp.workdps(60):
        for a, b in zip(one, other, strict=True):
            assert abs(a / b - 1) < mp.mpf(10) ** -50
    assert_close(contact_fall(chain, *case[1:]), other)


@pytest.mark.parametrize("tau", [1e-9, 1e-6, 1e-3, 1e-2])
def test_the_papers_chain_from_a_nanosecond_to_ten_milliseconds(tau):
    gains = gains_at(40.0)
    end = contact_fall(PAPERS, gains, DROP, GRAVITY, tau)
    wanted = superposed_fall(PAPERS.heights, gains, DROP, GRAVITY, tau, digits=60)
    assert_close(end, wanted, 2e-15)


@examples(80)
@given(chains(most=8), ALPHAS, GAMMAS, DROPS, GRAVITIES, CONTACTS, SPEEDS)
def test_agrees_with_the_reference(chain, alpha, gamma, drop, gravity, tau, speed):
    gains = kicks(chain, [alpha] * chain.rods, gamma)
    end = contact_fall(chain, gains, drop, gravity, tau, speed)
    assert_close(end, superposed_fall(chain.heights, gains, drop, gravity, tau, speed))


@examples(60)
@given(chains(most=6), decades(-250, -12), GAMMAS, DROPS, GRAVITIES, CONTACTS)
def test_keeps_its_digits_however_small_alpha(chain, alpha, gamma, drop, gravity, tau):
    gains = kicks(chain, [alpha] * chain.rods, gamma)
    end = contact_fall(chain, gains, drop, gravity, tau)
    assert_close(end, superposed_fall(chain.heights, gains, drop, gravity, tau))


@examples(60)
@given(chains(most=6), ALPHAS, GAMMAS, DROPS, decades(-2, 8), SPEEDS)
def test_keeps_its_digits_where_legs_are_short_against_the_contact_time(
    chain, alpha, gamma, drop, tau, speed
):
    gains = kicks(chain, [alpha] * chain.rods, gamma)
    end = contact_fall(chain, gains, drop, GRAVITY, tau, speed)
    assert_close(end, superposed_fall(chain.heights, gains, drop, GRAVITY, tau, speed))


@examples(200)
@given(st.one_of(decades(-9, 6), st.floats(0.5 * _SERIES, 2.0 * _SERIES)))
def test_series_and_closed_form_of_the_response(x):
    assert_ramp(x)


@pytest.mark.parametrize(
    "x", [math.nextafter(_SERIES, 0.0), _SERIES, math.nextafter(_SERIES, math.inf)]
)
def test_series_and_closed_form_meet(x):
    assert_ramp(x)


def assert_ramp(x):
    one, two = _ramp(x)
    with mp.workdps(80):
        exact, ahead = mp.mpf(x), mp.exp(-mp.mpf(x))
        ways = exact - 2 + (2 + exact) * ahead, exact - 1 + ahead
        speeds = 1 - (1 + exact) * ahead, 1 - ahead
    assert close(one, ways[0], 1e-15)
    assert close(two, ways[1], 1e-15)
    first, second = _risen(x, one, two)
    assert close(first, speeds[0], 3e-15)  # a difference near the seam
    assert close(second, speeds[1], 1e-15)


@pytest.mark.parametrize("incline", [0.0, 40.0, 80.0])
def test_first_order_towards_the_discrete_fall(incline):
    gains = gains_at(incline)
    instant = fall(PAPERS, alpha_inclined(0.5, 0.2, incline), GAMMA, DROP, GRAVITY)

    def off(tau):
        end = contact_fall(PAPERS, gains, DROP, GRAVITY, tau)
        return (
            end.separation_m - instant.separation_m,
            end.speed_m_s - instant.speed_m_s,
            end.time_s - instant.time_s,
        )

    for tau in (1e-4, 1e-5, 1e-6, 1e-7):
        orders = [math.log2(one / half) for one, half in zip(off(tau), off(0.5 * tau), strict=True)]
        # The next order is τ², with a coefficient of order 1; under it lie roundings of 1e-15.
        assert orders == pytest.approx([1.0] * 3, abs=20.0 * tau + 1e-14 / tau)
    # Not any more once impacts go on while the next ones come, 7 ms apart at the end.
    assert abs(math.log2(off(0.02)[0] / off(0.01)[0]) - 1.0) > 0.1


@examples(40)
@given(chains(most=6, mass_decades=0.5), st.floats(0.02, 0.5), st.floats(0.5, 3.0), decades(-3, 1))
def test_random_chains_come_to_the_discrete_fall(chain, alpha, gamma, drop):
    gains = kicks(chain, [alpha] * chain.rods, gamma)
    instant = fall(chain, alpha, gamma, drop, GRAVITY)
    strikes = [0.0, *(hit.time_s for hit in hits(chain, gains, drop, GRAVITY))]
    tau = 1e-4 * min(later - sooner for sooner, later in pairwise(strikes))
    late = [contact_fall(chain, gains, drop, GRAVITY, each) for each in (2 * tau, tau)]
    double, single = (end.time_s - instant.time_s for end in late)
    # What T(2τ) − 2 T(τ) + T(0) leaves: the next order, (τ/leg) each leg, and of each T at most
    # 6 × 16 roundings, those of its legs and of their sum.
    # T is later as a rule, sooner where a long leg follows: what is late strikes faster at its end.
    assert abs(double - 2.0 * single) <= 1e-3 * abs(single) + 4 * 96 * 2.0**-53 * instant.time_s
    for end, each in zip(late, (2 * tau, tau), strict=True):
        # A pull that is late by τ costs ΔV τ of the way; what follows from that is of its size.
        assert abs(end.separation_m - instant.separation_m) < 10.0 * instant.speed_m_s * each


@examples(60)
@given(decades(-12, 12), decades(-3, 3), decades(-2, 1), st.floats(1e-9, 0.02))
@example(gain=581.06, speed=1.0, gap=1.0, share=1e-9)
@example(gain=1e12, speed=1.0, gap=1.0, share=1e-3)
def test_one_pull_without_gravity(gain, speed, gap, share):
    """Over in time, a pull ΔV that is late by τ leaves Δz = ΔV (d − v τ)/(v + ΔV).

    Every sum on the way is of positive parts, so no rounding grows: six make the time of the leg,
    and six more Δz of it. Sixteen of 2⁻⁵³ are room for a third more.
    """
    chain = Chain((1.0, 1.0), (0.0, gap))
    tau = share * gap / (speed * (1.0 + gain))  # e^-100 of the pull is missing
    end = contact_fall(chain, [gain, 0.0], 0.3, 0.0, tau, speed)
    kept = Fraction(gap) - Fraction(speed) * Fraction(tau)
    wanted = Fraction(gain) * kept / (1 + Fraction(gain))
    assert close(end.separation_m, wanted, 16 * 2.0**-53)
    assert close(end.speed_m_s, Fraction(speed) * (1 + Fraction(gain)), 16 * 2.0**-53)


def test_a_pull_that_has_hardly_begun():
    """Early on it grows as t/τ'²: a way of ΔV t³/6τ'², here with t = 10 ms and τ' = 500 s."""
    chain = Chain((1.0, 1.0), (0.0, 0.1))
    end = contact_fall(chain, [0.25, 0.0], 1.0, 0.0, 1000.0, 10.0)
    assert end.separation_m == pytest.approx(2.5 * 0.01**3 / (6.0 * 500.0**2), rel=1e-4)
    assert end.speed_m_s - 10.0 == pytest.approx(2.5 * 0.01**2 / (2.0 * 500.0**2), rel=1e-4)


def test_pulls_that_come_too_late_leave_free_fall():
    end = contact_fall(PAPERS, gains_at(40.0), DROP, GRAVITY, 1e6)
    assert 0.0 < end.separation_m < 1e-12
    assert end.speed_m_s == pytest.approx(free_fall_speed(PAPERS, DROP, GRAVITY), rel=1e-10)


def test_without_pull_the_contact_time_is_nothing():
    one, other = (contact_fall(PAPERS, [0.0] * 25, DROP, GRAVITY, tau) for tau in (1e-9, 1.0))
    assert one == other
    assert one.separation_m == 0.0
    assert close(one.speed_m_s, free_fall_speed(PAPERS, DROP, GRAVITY), TIGHT)


@examples(60)
@given(chains(), ALPHAS, GAMMAS, DROPS, GRAVITIES, CONTACTS, SPEEDS)
def test_units_do_not_matter(chain, alpha, gamma, drop, gravity, tau, speed):
    """Four times the gravity in half the time, or sixteen times the size: to the last bit."""
    gains = kicks(chain, [alpha] * chain.rods, gamma)
    end = contact_fall(chain, gains, drop, gravity, tau, speed)
    strong = contact_fall(chain, gains, drop, 4.0 * gravity, 0.5 * tau, 2.0 * speed)
    assert (strong.separation_m, strong.speed_m_s) == (end.separation_m, 2.0 * end.speed_m_s)
    assert strong.time_s == 0.5 * end.time_s
    tall = Chain(chain.masses, tuple(16.0 * z for z in chain.heights))
    large = contact_fall(tall, gains, 16.0 * drop, gravity, 4.0 * tau, 4.0 * speed)
    assert (large.separation_m, large.speed_m_s) == (16.0 * end.separation_m, 4.0 * end.speed_m_s)
    assert large.time_s == 4.0 * end.time_s


@pytest.mark.parametrize("tau", [0.0, -1e-9, math.nan, math.inf])
def test_a_contact_time_must_be_above_zero(tau):
    with pytest.raises(DomainError, match="a contact time of") as caught:
        contact_fall(PAPERS, gains_at(40.0), DROP, GRAVITY, tau)
    assert "above zero" in caught.value.hint


@pytest.mark.parametrize("gain", [-1e-300, -0.1, math.nan])
def test_a_rod_must_not_push(gain):
    gains = gains_at(40.0)
    gains[3] = gain
    with pytest.raises(DomainError, match="pushes the chain up"):
        contact_fall(PAPERS, gains, DROP, GRAVITY, 1e-6)


@pytest.mark.parametrize("drop", [0.0, 0.18])
def test_without_gravity_or_speed_there_is_no_fall(drop):
    with pytest.raises(DomainError, match="never falls"):
        contact_fall(PAPERS, gains_at(40.0), drop, 0.0, 1e-6)


def test_each_rod_needs_its_gain():
    with pytest.raises(ValueError, match="shorter"):
        contact_fall(PAPERS, gains_at(40.0)[1:], DROP, GRAVITY, 1e-6)
