"""The fall in air against many digits, quadrature, a general solver and its own energy."""

import math
from fractions import Fraction

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from mpmath import mp

from rig.errors import DomainError
from rig.model.drag import air_legs, drag_fall, drag_leg, fallen, falling_speed, leg_drags
from rig.model.fall import fall, hits, kicks
from tests.examples import examples
from tests.model.air_reference import exact_leg, exact_way
from tests.model.chains import ALPHAS, DROPS, GAMMAS, GRAVITIES, SPEEDS, chains, close, decades

DISTANCES = decades(-4, 2)
KAPPAS = decades(-15, 2)  # 1/m


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
    assert hits(chain, gains, drop, gravity, speed, air_legs(still)) == hits(
        chain, gains, drop, gravity, speed
    )


@examples(80)
@given(chains(), st.data())
def test_drag_of_a_leg_is_that_of_what_still_falls(chain, data):
    size = chain.rods
    drags = data.draw(st.lists(decades(-6, 0), min_size=size, max_size=size))
    for k, kappa in enumerate(leg_drags(chain, drags)):
        wanted = sum(map(Fraction, drags[k:])) / sum(map(Fraction, chain.masses[k:]))
        assert kappa == float(wanted)
