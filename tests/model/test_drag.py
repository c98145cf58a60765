"""The fall in air against many digits, quadrature, a general solver and its own energy."""

import math
from fractions import Fraction

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from mpmath import mp

from rig.errors import DomainError
from rig.model.chain import Chain
from rig.model.drag import air_legs, drag_fall, drag_leg, fallen, falling_speed, leg_drags
from rig.model.fall import fall, hits, kicks
from tests.examples import examples
from tests.model.air_reference import exact_fall, exact_leg, exact_way
from tests.model.chains import ALPHAS, DROPS, GAMMAS, GRAVITIES, SPEEDS, chains, close, decades

TIGHT = 1e-13
DISTANCES = decades(-4, 2)
KAPPAS = decades(-15, 2)  # 1/m
AIR = decades(-6, 1)  # of κ for whole falls


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


@pytest.mark.parametrize(("speed", "kappa"), [(0.0, 0.0), (0.0, 0.1), (1.0, 1e4)])
def test_without_gravity_a_leg_may_have_no_end(speed, kappa):
    with pytest.raises(DomainError, match="never arrives"):
        drag_leg(1.0, speed, 0.0, kappa)
    assert drag_leg(0.0, speed, 0.0, kappa) == (speed, 0.0)


@examples(200)
@given(decades(-4, 3), SPEEDS, GRAVITIES, st.one_of(st.just(0.0), KAPPAS))
def test_free_motion_against_many_digits(time, speed, gravity, kappa):
    assume(math.sqrt(kappa * gravity) * time < 1e5)
    with mp.workdps(120):
        assert close(fallen(time, gravity, kappa, speed), exact_way(time, speed, gravity, kappa),
                     3e-15)  # fmt: skip
        v, g, k = map(mp.mpf, (speed, gravity, kappa))
        reach = mp.tanh(mp.sqrt(k * g) * time) / mp.sqrt(k * g) if k else mp.mpf(time)
        wanted = (v + g * reach) / (1 + k * v * reach)
        assert close(falling_speed(time, gravity, kappa, speed), wanted, 3e-15)


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
    assert hits(chain, gains, drop, gravity, speed, air_legs(still)) == hits(
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
        wanted = exact_fall(chain.heights, gains, kappas, drop, gravity, speed)
        if chain.rods > 2 or drop or speed:
            assert close(end.separation_m, wanted[0], many)
        else:  # one rod is struck, and at rest
            assert end.separation_m == 0.0
        assert close(end.speed_m_s, wanted[1], many)
        assert close(end.time_s, wanted[2], many)


@examples(100)
@given(DISTANCES, DROPS, SPEEDS, decades(-2, 2), AIR, decades(-12, 2), st.booleans())
def test_unlike_drag_loses_no_more_than_the_difference_of_drags(
    gap, drop, speed, gravity, kappa, change, less
):
    kappas = [kappa, kappa / (1 + change) if less else kappa * (1 + change)]
    assume(kappas[0] != kappas[1])
    chain = Chain((1.0, 1.0), (0.0, gap))
    end = drag_fall(chain, [0.0, 0.0], kappas, drop, gravity, speed)
    with mp.workdps(200):
        wanted = exact_fall(chain.heights, [0.0, 0.0], kappas, drop, gravity, speed)
        condition = max(kappas) / abs(kappas[1] - kappas[0])
        way = 1.0 + max(kappas) * (drop + gap)
        assert close(end.separation_m, wanted[0], 1e-14 * way * way * condition)
        assert close(end.speed_m_s, wanted[1], TIGHT * way)
        assert close(end.time_s, wanted[2], TIGHT * way)


@examples(80)
@given(chains(), st.data())
def test_drag_of_a_leg_is_that_of_what_still_falls(chain, data):
    size = chain.rods
    drags = data.draw(st.lists(decades(-6, 0), min_size=size, max_size=size))
    for k, kappa in enumerate(leg_drags(chain, drags)):
        wanted = sum(map(Fraction, drags[k:])) / sum(map(Fraction, chain.masses[k:]))
        assert kappa == float(wanted)
