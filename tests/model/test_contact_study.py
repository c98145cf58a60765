"""How long impacts may last: orders of convergence and the first contact time that matters."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp

from rig.errors import DomainError
from rig.model.chain import Chain
from rig.model.contact import contact_fall
from rig.model.contact_study import (
    Departure,
    departures,
    discrete_fall,
    longest_contact,
    orders,
)
from rig.model.fall import fall, free_fall_speed, kicks
from rig.model.impact import alpha_inclined
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
from tests.model.contact_reference import superposed_fall
from tests.model.reference import reference_fall

DROP, GRAVITY = 0.18, 9.81
PAPERS = even_chain(25)


def gains_at(incline_deg):
    return kicks(PAPERS, [alpha_inclined(0.5, 0.2, incline_deg)] * 25, 4 / 3)


def longest(measurand, share, incline_deg=40.0, gravity=GRAVITY):
    return longest_contact(PAPERS, gains_at(incline_deg), DROP, gravity, measurand, share)


def change(measurand, tau, incline_deg=40.0):
    """Relative, with its sign."""
    gains = gains_at(incline_deg)
    instant = discrete_fall(PAPERS, gains, DROP, GRAVITY)
    end = contact_fall(PAPERS, gains, DROP, GRAVITY, tau)
    name = "separation_m" if measurand == "separation" else "speed_m_s"
    return getattr(end, name) / getattr(instant, name) - 1.0


@examples(60)
@given(chains(), ALPHAS, GAMMAS, DROPS, GRAVITIES, SPEEDS)
def test_the_discrete_fall_from_gains(chain, alpha, gamma, drop, gravity, speed):
    gains = kicks(chain, [alpha] * chain.rods, gamma)
    found = discrete_fall(chain, gains, drop, gravity, speed)
    wanted = fall(chain, alpha, gamma, drop, gravity, speed)
    assert close(found.separation_m, wanted.separation_m, 1e-13)
    assert close(found.speed_m_s, wanted.speed_m_s, 1e-13)
    assert close(found.time_s, wanted.time_s, 1e-13)


def test_departures_are_those_of_many_digits():
    chain = even_chain(4)
    gains = kicks(chain, [0.2] * 4, 4 / 3)
    taus = [1e-9, 1e-5, 1e-2]
    found = departures(chain, gains, DROP, GRAVITY, taus)
    assert [one.contact_time_s for one in found] == taus
    with mp.workdps(40):
        instant = reference_fall(chain.masses, chain.heights, 0.2, 4 / 3, DROP, GRAVITY, digits=40)
        for one in found:
            end = superposed_fall(
                chain.heights, gains, DROP, GRAVITY, one.contact_time_s, digits=40
            )
            assert one.separation_m == pytest.approx(
                float(end.separation - instant.separation), rel=1e-10, abs=1e-15
            )
            assert one.speed_m_s == pytest.approx(
                float(end.speed - instant.speed), rel=1e-10, abs=1e-14
            )


def test_the_order_is_one_while_impacts_are_over_in_time():
    found = departures(PAPERS, gains_at(40.0), DROP, GRAVITY, [1e-4 / 2**k for k in range(10)])
    for one, order in zip(found, orders(found), strict=False):
        assert order.separation == pytest.approx(1.0, abs=2.0 * one.contact_time_s + 1e-7)
        assert order.speed == pytest.approx(1.0, abs=20.0 * one.contact_time_s + 1e-7)


def test_the_order_is_another_once_they_are_not():
    found = departures(PAPERS, gains_at(40.0), DROP, GRAVITY, [0.002, 0.001, 1e-4])
    overlapping, _ = orders(found)
    assert abs(overlapping.speed - 1.0) > 0.1


@examples(60)
@given(decades(-12, 3), decades(-12, 3), decades(-9, -1), st.floats(-3.0, 3.0), st.floats(1.1, 9.0))
def test_orders_of_known_powers(separation, speed, tau, power, ratio):
    found = [
        Departure(t, -separation * t**power, speed * t ** (1.0 - power)) for t in (tau, tau / ratio)
    ]
    (order,) = orders(found)
    assert order.separation == pytest.approx(power, abs=1e-9)
    assert order.speed == pytest.approx(1.0 - power, abs=1e-9)


@pytest.mark.parametrize(
    "pair",
    [
        [Departure(1e-3, 0.0, 1.0), Departure(1e-4, 1.0, 1.0)],
        [Departure(1e-3, 1.0, 1.0), Departure(1e-4, 1.0, 0.0)],
        [Departure(1e-3, 1.0, 1.0), Departure(1e-3, 2.0, 2.0)],
    ],
)
def test_no_order_without_two_departures(pair):
    with pytest.raises(DomainError, match="no order of convergence"):
        orders(pair)


@pytest.mark.parametrize("incline", [30.0, 40.0, 60.0, 80.0])
@pytest.mark.parametrize("measurand", ["separation", "speed"])
@pytest.mark.parametrize("share", [1e-5, 1e-3, 2e-2])
def test_the_longest_contact_is_the_first_that_changes_as_much(incline, measurand, share):
    found = longest(measurand, share, incline)
    assert abs(change(measurand, found, incline)) == pytest.approx(share, rel=1e-9)
    assert abs(change(measurand, found * (1.0 - 1e-6), incline)) < share
    assert abs(change(measurand, found * (1.0 + 1e-6), incline)) > share
    below = [found * 0.97**k for k in range(1, 200)]
    assert all(abs(change(measurand, tau, incline)) < share for tau in below)


def test_the_separation_allows_69_microseconds_for_a_thousandth_and_the_speed_40_times_that():
    separation, speed = longest("separation", 1e-3), longest("speed", 1e-3)
    assert separation == pytest.approx(69.34e-6, rel=1e-3)
    assert speed == pytest.approx(2.880e-3, rel=1e-3)
    # Up to there Δz has only fallen; V has risen first and come back.
    assert change("separation", separation) < 0.0
    assert change("speed", 1e-3) > 0.0
    assert change("speed", speed) < 0.0
    gains = gains_at(40.0)
    with mp.workdps(40):
        exact = superposed_fall(PAPERS.heights, gains, DROP, GRAVITY, separation, digits=40)
        alpha = alpha_inclined(0.5, 0.2, 40.0)
        instant = reference_fall(
            PAPERS.masses, PAPERS.heights, alpha, 4 / 3, DROP, GRAVITY, digits=40
        )
        assert abs(1 - exact.separation / instant.separation) / mp.mpf("1e-3") == pytest.approx(
            1.0, abs=1e-10
        )


def test_a_rise_of_the_speed_that_comes_back_is_not_missed():
    taus = [2e-4 * 1.01**k for k in range(300)]
    rise, at_most = max((change("speed", tau), tau) for tau in taus)
    assert 2e-4 < at_most < taus[-1]
    found = longest("speed", 0.98 * rise)
    assert found < at_most
    assert change("speed", found) > 0.0
    assert longest("speed", 1.02 * rise) > at_most


def test_a_small_share_is_first_order():
    """Δz falls by 1.6652 m per second of contact time, V rises by 4.0151 m/s."""
    (slope,) = departures(PAPERS, gains_at(40.0), DROP, GRAVITY, [1e-6])
    instant = discrete_fall(PAPERS, gains_at(40.0), DROP, GRAVITY)
    assert slope.separation_m / 1e-6 == pytest.approx(-1.6652, rel=1e-4)
    assert slope.speed_m_s / 1e-6 == pytest.approx(4.0151, rel=1e-4)
    found = longest("separation", 1e-6)
    assert found == pytest.approx(1e-12 * instant.separation_m / -slope.separation_m, rel=1e-5)
    found = longest("speed", 1e-6)
    assert found == pytest.approx(1e-12 * instant.speed_m_s / slope.speed_m_s, rel=1e-5)


def test_gravity_only_sets_the_pace():
    assert longest("separation", 1e-3, gravity=4.0 * GRAVITY) == pytest.approx(
        0.5 * longest("separation", 1e-3), rel=1e-12
    )


def test_the_speed_cannot_lose_more_than_its_gain_on_free_fall():
    instant = discrete_fall(PAPERS, gains_at(80.0), DROP, GRAVITY)
    most = 1.0 - free_fall_speed(PAPERS, DROP, GRAVITY) / instant.speed_m_s
    assert longest("speed", 1.001 * most, 80.0) == math.inf
    assert longest("speed", 0.999 * most, 80.0) < math.inf
    # Of Δz all is lost in the end.
    assert longest("separation", 0.999, 80.0) < math.inf


@pytest.mark.parametrize("share", [0.0, -0.1, 1.0, math.nan])
def test_a_share_is_between_0_and_1(share):
    with pytest.raises(DomainError, match="a share of"):
        longest("separation", share)


def test_without_pulls_no_contact_time_matters():
    with pytest.raises(DomainError, match="no rod pulls"):
        longest_contact(Chain((1.0, 1.0), (0.0, 1.0)), [0.0, 0.0], DROP, GRAVITY, "speed", 1e-3)
