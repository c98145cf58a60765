"""The fall in air against many digits, quadrature, a general solver and its own energy."""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from mpmath import mp

from rig.errors import DomainError
from rig.model.chain import Chain
from rig.model.drag import (
    drag_fall,
    drag_hits,
    drag_leg,
    fallen,
    falling_speed,
    leg_drags,
    terminal_speed,
)
from rig.model.fall import fall, hits, kicks
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

TIGHT = 1e-13
DISTANCES = decades(-4, 2)
KAPPAS = decades(-15, 2)  # 1/m
AIR = decades(-6, 1)  # of κ for whole falls


def exact_leg(distance, speed, gravity, kappa):
    """Speed and time at the end, as d(v²)/dz = 2(g − κv²) and dt = dv/(g − κv²) integrate."""
    d, v, g, k = map(mp.mpf, (distance, speed, gravity, kappa))
    left, u, rate = mp.exp(-2 * k * d), mp.sqrt(g / k), mp.sqrt(k * g)
    arrival = mp.sqrt(g / k - (g / k - v * v) * left)
    return arrival, (k * d + mp.log((arrival + u) / (v + u))) / rate


def exact_way(time, speed, gravity, kappa):
    t, v, g, k = map(mp.mpf, (time, speed, gravity, kappa))
    x = mp.sqrt(k * g) * t
    return mp.log(mp.cosh(x) + v * mp.sqrt(k / g) * mp.sinh(x)) / k


def exact_fall(chain, gains, kappas, drop, gravity, speed):
    """Δz as a difference of two heights, V and t."""
    now = mp.mpf(speed)
    time, before = mp.mpf(0), -mp.mpf(drop)
    for height, gain, kappa in zip(chain.heights, gains, kappas, strict=True):
        arrival = now
        if height != before:
            arrival, leg = exact_leg(mp.mpf(height) - before, now, gravity, kappa)
            time += leg
        now, before = arrival * (1 + mp.mpf(gain)), mp.mpf(height)
    separation = mp.mpf(drop) + mp.mpf(chain.length) - exact_way(time, speed, gravity, kappas[0])
    return separation, arrival, time


# In e^(−κd) the rounding of κd counts κd times.
def tolerance(kappa, distance):
    return 2e-15 * (1.0 + kappa * distance)


@examples(200)
@given(DISTANCES, SPEEDS, GRAVITIES, KAPPAS)
def test_a_leg_against_many_digits(distance, speed, gravity, kappa):
    with mp.workdps(120):
        arrival, duration = drag_leg(distance, speed, gravity, kappa)
        wanted = exact_leg(distance, speed, gravity, kappa)
        assert close(arrival, wanted[0], tolerance(kappa, distance))
        assert close(duration, wanted[1], tolerance(kappa, distance))


@examples(150)
@given(DISTANCES, GRAVITIES, decades(-6, 2), st.floats(-17, 0), st.sampled_from([-1, 1]))
def test_a_leg_at_about_the_terminal_speed(distance, gravity, kappa, off, side):
    speed = terminal_speed(gravity, kappa) * (1.0 + side * 10.0**off)
    with mp.workdps(120):
        arrival, duration = drag_leg(distance, speed, gravity, kappa)
        wanted = exact_leg(distance, speed, gravity, kappa)
        assert close(arrival, wanted[0], tolerance(kappa, distance))
        assert close(duration, wanted[1], tolerance(kappa, distance))


@pytest.mark.parametrize("kappa", [1e-4, 0.02, 3.0])
@pytest.mark.parametrize("speed", [0.0, 0.7, 40.0, 900.0])
def test_a_leg_against_quadrature(kappa, speed):
    """∫ dv/(g − κv²) is the time and ∫ v dv/(g − κv²) the way: no closed form is used."""
    distance, gravity = 0.3, 9.81
    arrival, duration = drag_leg(distance, speed, gravity, kappa)
    with mp.workdps(30):
        ends = [mp.mpf(speed), mp.mpf(arrival)]
        time = mp.quad(lambda v: 1 / (gravity - mp.mpf(kappa) * v * v), ends)
        way = mp.quad(lambda v: v / (gravity - mp.mpf(kappa) * v * v), ends)
    assert close(duration, time, 1e-12)
    assert close(distance, way, 1e-12)


@examples(80)
@given(DISTANCES, decades(-3, 3), decades(-6, 2))
def test_without_gravity_speed_dies_away(distance, speed, kappa):
    assume(kappa * distance < 300)
    arrival, duration = drag_leg(distance, speed, 0.0, kappa)
    x = kappa * distance
    assert close(arrival, speed * math.exp(-x), 2e-15 * (1 + x))
    assert close(duration, math.expm1(x) / (kappa * speed), 2e-15 * (1 + x))
    # A gravity too small to matter changes nothing.
    faint = drag_leg(distance, speed, 1e-300, kappa)
    assert close(faint[0], arrival, 1e-15)
    assert close(faint[1], duration, 1e-14 * (1 + x))


@examples(80)
@given(GRAVITIES, decades(-3, 2), st.one_of(st.just(0.0), decades(-3, 4)))
def test_every_long_leg_ends_at_the_terminal_speed(gravity, kappa, share):
    terminal = terminal_speed(gravity, kappa)
    speed = share * terminal
    distance = (40.0 + 2.0 * math.log1p(share)) / kappa
    arrival, duration = drag_leg(distance, speed, gravity, kappa)
    assert close(arrival, terminal, 1e-15)
    assert duration > 0.0
    further = drag_leg(2.0 * distance, speed, gravity, kappa)[1]
    assert close(further - duration, distance / terminal, 1e-12)
    short = drag_leg(0.1 / kappa, speed, gravity, kappa)[0]
    low, high = sorted((speed, terminal))
    assert low * (1 - 1e-15) <= short <= high * (1 + 1e-15)


def test_no_drag_has_no_terminal_speed():
    assert terminal_speed(9.81, 0.0) == math.inf


@pytest.mark.parametrize(("speed", "kappa"), [(0.0, 0.0), (0.0, 0.1), (1.0, 1e4)])
def test_without_gravity_a_leg_may_have_no_end(speed, kappa):
    with pytest.raises(DomainError, match="never arrives"):
        drag_leg(1.0, speed, 0.0, kappa)
    assert drag_leg(0.0, speed, 0.0, kappa) == (speed, 0.0)


@examples(200)
@given(decades(-4, 3), SPEEDS, GRAVITIES, KAPPAS)
def test_free_motion_against_many_digits(time, speed, gravity, kappa):
    assume(math.sqrt(kappa * gravity) * time < 1e5)
    with mp.workdps(120):
        assert close(fallen(time, gravity, kappa, speed), exact_way(time, speed, gravity, kappa),
                     3e-15)  # fmt: skip
        v, g, k = map(mp.mpf, (speed, gravity, kappa))
        reach = mp.tanh(mp.sqrt(k * g) * time) / mp.sqrt(k * g)
        wanted = (v + g * reach) / (1 + k * v * reach)
        assert close(falling_speed(time, gravity, kappa, speed), wanted, 3e-15)


@examples(80)
@given(decades(-4, 3), SPEEDS, GRAVITIES)
def test_free_motion_without_drag(time, speed, gravity):
    way = Fraction(time) * (Fraction(speed) + Fraction(gravity) * Fraction(time) / 2)
    assert close(fallen(time, gravity, 0.0, speed), float(way), 1e-15)
    assert close(falling_speed(time, gravity, 0.0, speed), speed + gravity * time, 1e-15)


@examples(100)
@given(chains(), ALPHAS, GAMMAS, DROPS, GRAVITIES, SPEEDS)
def test_without_drag_it_is_the_plain_fall_to_the_last_bit(
    chain, alpha, gamma, drop, gravity, speed
):
    gains = kicks(chain, [alpha] * chain.rods, gamma)
    still = leg_drags(chain, [0.0] * chain.rods)
    assert drag_fall(chain, gains, still, drop, gravity, speed) == fall(
        chain, alpha, gamma, drop, gravity, speed
    )
    assert drag_hits(chain, gains, still, drop, gravity, speed) == hits(
        chain, gains, drop, gravity, speed
    )


@examples(100)
@given(chains(most=8), ALPHAS, GAMMAS, DROPS, decades(-2, 2), SPEEDS, AIR)
def test_like_drag_keeps_every_digit_of_the_separation(
    chain, alpha, gamma, drop, gravity, speed, kappa
):
    gains = kicks(chain, [alpha] * chain.rods, gamma)
    kappas = [kappa] * chain.rods
    length = drop + chain.length
    # In much air what was gained dies away as e^(−2κ × way), with that number's relative error.
    many = TIGHT * (1.0 + kappa * length)
    end = drag_fall(chain, gains, kappas, drop, gravity, speed)
    with mp.workdps(max(200, 60 + round(2 * kappa * length))):
        wanted = exact_fall(chain, gains, kappas, drop, gravity, speed)
        if chain.rods > 2 or drop or speed:
            assert close(end.separation_m, wanted[0], many)
        else:  # one rod is struck, and at rest
            assert end.separation_m == 0.0
        assert close(end.speed_m_s, wanted[1], many)
        assert close(end.time_s, wanted[2], many)


@examples(100)
@given(chains(most=8, mass_decades=2), ALPHAS, GAMMAS, DROPS, decades(-2, 2), SPEEDS, st.data())
def test_unlike_drag_costs_last_places_of_the_way(chain, alpha, gamma, drop, gravity, speed, data):
    gains = kicks(chain, [alpha] * chain.rods, gamma)
    drags = [m * data.draw(decades(-4, -1)) for m in chain.masses]
    kappas = leg_drags(chain, drags)
    length = drop + chain.length
    end = drag_fall(chain, gains, kappas, drop, gravity, speed)
    with mp.workdps(200):
        wanted = exact_fall(chain, gains, kappas, drop, gravity, speed)
        many = TIGHT * (1.0 + max(kappas) * length)
        assert abs(end.separation_m - wanted[0]) <= many * length
        assert close(end.speed_m_s, wanted[1], many)
        assert close(end.time_s, wanted[2], many)


@examples(80)
@given(chains(), st.data())
def test_drag_of_a_leg_is_that_of_what_still_falls(chain, data):
    size = chain.rods
    drags = data.draw(st.lists(decades(-6, 0), min_size=size, max_size=size))
    for k, kappa in enumerate(leg_drags(chain, drags)):
        wanted = sum(map(Fraction, drags[k:])) / sum(map(Fraction, chain.masses[k:]))
        assert kappa == float(wanted)


def test_like_rods_have_like_drag_whatever_the_rounding():
    chain = replace(even_chain(25), masses=(0.1,) * 25)
    assert leg_drags(chain, [0.007] * 25) == [0.007 / 0.1] * 25


def integrated(chain, gains, kappas, drop, gravity, speed):
    """Both chains by a Taylor-series solver of v' = g − κv², stopped at each impact."""

    def steps(kappa, start):
        return mp.odefun(lambda _, y: [y[1], gravity - kappa * y[1] ** 2], 0, start, tol=1e-20)

    now, time, before = mp.mpf(speed), mp.mpf(0), -mp.mpf(drop)
    for height, gain, kappa in zip(chain.heights, gains, kappas, strict=True):
        motion = steps(kappa, [mp.mpf(0), now])
        way, t = height - before, (height - before) / (now + 1)
        for _ in range(60):  # Newton's method
            done, arrival = motion(t)
            if abs(way - done) < 1e-18:
                break
            t += (way - done) / arrival
        now, before, time = arrival * (1 + gain), height, time + t
    free = steps(kappas[0], [mp.mpf(0), mp.mpf(speed)])(time)[0]
    return drop + chain.length - free, arrival, time


@pytest.mark.parametrize("drags", [(0.3, 0.3, 0.3), (0.01, 0.2, 0.9)])
def test_a_whole_fall_against_a_general_solver(drags):
    chain = Chain((1.0, 0.8, 0.5), (0.0, 0.4, 0.9))
    gains = kicks(chain, [0.2] * 3, 4 / 3)
    kappas = leg_drags(chain, drags)
    end = drag_fall(chain, gains, kappas, 0.2, 9.81, 0.4)
    with mp.workdps(25):
        wanted = integrated(chain, gains, kappas, 0.2, 9.81, 0.4)
    assert close(end.separation_m, wanted[0], TIGHT)
    assert close(end.speed_m_s, wanted[1], TIGHT)
    assert close(end.time_s, wanted[2], TIGHT)


@examples(60)
@given(chains(most=6, mass_decades=2), ALPHAS, DROPS, decades(-1, 2), SPEEDS, st.data())
def test_energy_is_balanced_by_the_work_of_the_drag(chain, alpha, drop, gravity, speed, data):
    """What falls loses height, gains speed, and leaves Σc ∫v² dz in the air."""
    drags = [m * data.draw(decades(-4, 0)) for m in chain.masses]
    gains = kicks(chain, [alpha] * chain.rods, 4 / 3)
    kappas = leg_drags(chain, drags)
    assume(max(kappas) * (drop + chain.length) < 5)
    nodes, weights = np.polynomial.legendre.leggauss(30)
    heights = [-drop, *chain.heights]
    events = drag_hits(chain, gains, kappas, drop, gravity, speed)
    before = speed
    for k, (event, (low, high)) in enumerate(zip(events, pairwise(heights), strict=True)):
        mass, drag = math.fsum(chain.masses[k:]), math.fsum(drags[k:])
        way = high - low
        speeds = [drag_leg(way * 0.5 * (1 + x), before, gravity, kappas[k])[0] for x in nodes]
        work = drag * 0.5 * way * float(weights @ np.square(speeds))
        gained = mass * 0.5 * (event.speed_before**2 - before**2)
        scale = mass * (gravity * way + 0.5 * max(before, event.speed_before) ** 2)
        assert abs(mass * gravity * way - gained - work) <= 1e-12 * scale
        before = event.speed_after


@examples(80)
@given(chains(), ALPHAS, GAMMAS, DROPS, GRAVITIES, GRAVITIES, AIR)
def test_separation_does_not_depend_on_gravity_in_air_either(
    chain, alpha, gamma, drop, here, there, kappa
):
    """Released at rest: with v = √g w the equation of motion is dw/dτ = 1 − κw²."""
    gains = kicks(chain, [alpha] * chain.rods, gamma)
    one, other = (
        drag_fall(chain, gains, [kappa] * chain.rods, drop, gravity) for gravity in (here, there)
    )
    many = TIGHT * (1.0 + kappa * (drop + chain.length))
    assert close(one.separation_m, other.separation_m, many)
    assert close(one.speed_m_s * math.sqrt(there / here), other.speed_m_s, many)


@examples(80)
@given(chains(), ALPHAS, GAMMAS, DROPS, GRAVITIES, SPEEDS, AIR, decades(-2, 1))
def test_more_drag_is_slower(chain, alpha, gamma, drop, gravity, speed, kappa, more):
    gains = kicks(chain, [alpha] * chain.rods, gamma)
    one, other = (
        drag_fall(chain, gains, [k] * chain.rods, drop, gravity, speed)
        for k in (kappa, kappa * (1 + more))
    )
    assert other.speed_m_s <= one.speed_m_s * (1 + TIGHT * (1 + kappa * (drop + chain.length)))
    assert other.time_s >= one.time_s * (1 - TIGHT)


def test_drag_of_the_order_met_with_light_rods():
    """Drag of 4 % of g at 5 m/s: slower, later, and hardly less apart."""
    chain = even_chain(25)
    kappa = 0.04 * 9.81 / 25
    gains = kicks(chain, [0.155] * 25, 4 / 3)
    air = drag_fall(chain, gains, leg_drags(chain, [kappa] * 25), 0.18, 9.81)
    none = fall(chain, 0.155, 4 / 3, 0.18, 9.81)
    assert 0.98 < air.speed_m_s / none.speed_m_s < 0.995
    assert 1.0 < air.time_s / none.time_s < 1.01
    assert 0.99 < air.separation_m / none.separation_m < 1.0
    twin = 0.18 + chain.length - fallen(air.time_s, 9.81, kappa)
    assert close(twin, air.separation_m, 1e-14)


@examples(80)
@given(DISTANCES, SPEEDS, GRAVITIES, AIR, st.floats(0.01, 0.99))
def test_a_leg_in_air_can_be_cut_anywhere(distance, speed, gravity, kappa, share):
    upper = share * distance
    lower = distance - upper
    whole = drag_leg(distance, speed, gravity, kappa)
    passing, first = drag_leg(upper, speed, gravity, kappa)
    arrival, second = drag_leg(lower, passing, gravity, kappa)
    many = TIGHT * (1.0 + kappa * distance)
    assert close(arrival, whole[0], many)
    assert close(first + second, whole[1], many)


@examples(80)
@given(chains(), ALPHAS, GAMMAS, DROPS, GRAVITIES, SPEEDS, AIR, st.integers(-15, 15))
def test_a_larger_scene_in_air_as_much_thinner(chain, alpha, gamma, drop, gravity, speed, kappa, n):
    """Lengths by 4^n, κ by 4^−n, speeds by 2^n: not a bit is rounded."""
    gains = kicks(chain, [alpha] * chain.rods, gamma)
    one = drag_fall(chain, gains, [kappa] * chain.rods, drop, gravity, speed)
    larger = replace(chain, heights=tuple(z * 4.0**n for z in chain.heights))
    thin = [kappa / 4.0**n] * chain.rods
    other = drag_fall(larger, gains, thin, drop * 4.0**n, gravity, speed * 2.0**n)
    assert other.separation_m == one.separation_m * 4.0**n
    assert other.speed_m_s == one.speed_m_s * 2.0**n
    assert other.time_s == one.time_s * 2.0**n


@examples(80)
@given(chains(), st.data(), decades(-9, 9), st.integers(-60, 60))
def test_only_ratios_of_drag_to_mass_matter(chain, data, scale, power):
    drags = [m * data.draw(decades(-4, 0)) for m in chain.masses]
    one = leg_drags(chain, drags)
    doubled = replace(chain, masses=tuple(m * 2.0**power for m in chain.masses))
    assert leg_drags(doubled, [c * 2.0**power for c in drags]) == one
    scaled = replace(chain, masses=tuple(m * scale for m in chain.masses))
    for found, wanted in zip(leg_drags(scaled, [c * scale for c in drags]), one, strict=True):
        assert close(found, wanted, 5e-16)
