"""The discrete fall, in air and without, one and many, against many digits and closed forms."""

import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from mpmath import mp

from rig.bench.references import exact_fall
from rig.errors import DomainError
from rig.model import batch
from rig.model.batch import falls, given_impacts, surface_impacts
from rig.model.chain import Chain
from rig.model.drag import drag_fall, drag_leg, fallen, falling_speed, leg_drags
from rig.model.fall import air_legs, fall, hits, kicks
from rig.model.impact import impact_on
from rig.model.surface import Pile, Surface
from rig.units import Quantity
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
from tests.model.reference import exact_leg, exact_way
from tests.refusals import refused

# Twelve legs of a dozen roundings each: 12 × 12 × 2^-53 is 1.6e-14 were all of one sign.
TIGHT = 1e-13
ALL_GRAVITIES = st.one_of(st.just(0.0), GRAVITIES)


@examples(150)
@given(chains(), ALPHAS, GAMMAS, DROPS, ALL_GRAVITIES, SPEEDS)
@example(even_chain(3, 0.5), 0.1, 1.0, 0.2, 1e-200, 0.0)  # of its own size is the speed alone
def test_agrees_with_the_second_implementation(chain, alpha, gamma, drop, gravity, speed):
    assume(gravity or speed)
    end = fall(chain, alpha, gamma, drop, gravity, speed)
    assert_close(end, true_fall(chain, alpha, gamma, drop, gravity, speed), TIGHT)


def true_fall(chain, alpha, gamma, *rest, digits=150):
    """The worst case of `tests.model.chains` cancels about 90 of them."""
    given = chain.masses, chain.heights, [alpha] * chain.rods, [gamma] * chain.rods
    return exact_fall(*given, *rest, digits=digits)


def assert_close(end, wanted, relative):
    assert close(end.separation_m, wanted["separation"], relative)
    assert close(end.speed_m_s, wanted["speed"], relative)
    assert close(end.time_s, wanted["time"], relative)


@pytest.mark.parametrize("drop", [0.0, 0.18])
def test_without_gravity_or_speed_there_is_no_fall(drop):
    refused(DomainError, "never falls", fall, even_chain(3), 0.1, 1.0, drop, 0.0)


def test_a_speed_beyond_all_floats_is_refused():
    chain = Chain((1e300, 1e300, 1e-300), (0.0, 0.1, 0.2))
    refused(DomainError, "range of numbers", fall, chain, 0.25, 0.0, 0.18, 9.81)


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
    refused(DomainError, "never arrives", drag_leg, 1.0, speed, 0.0, kappa)
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
    # Where one rod is struck, and at rest, Δz is exactly zero.
    assert_close(
        end, true_fall(chain, alpha, gamma, drop, gravity, speed, kappas, digits=200), many
    )


@examples(100)
@given(DISTANCES, DROPS, SPEEDS, decades(-2, 2), AIR, decades(-12, 2), st.booleans())
def test_unlike_drag_loses_no_more_than_the_difference_of_drags(
    gap, drop, speed, gravity, kappa, change, less
):
    kappas = [kappa, kappa / (1 + change) if less else kappa * (1 + change)]
    assume(kappas[0] != kappas[1])
    chain = Chain((1.0, 1.0), (0.0, gap))
    end = drag_fall(chain, [0.0, 0.0], kappas, drop, gravity, speed)
    wanted = true_fall(chain, 0.0, 0.0, drop, gravity, speed, kappas, digits=200)
    condition = max(kappas) / abs(kappas[1] - kappas[0])
    way = 1.0 + max(kappas) * (drop + gap)
    assert close(end.separation_m, wanted["separation"], 1e-14 * way * way * condition)
    assert close(end.speed_m_s, wanted["speed"], TIGHT * way)
    assert close(end.time_s, wanted["time"], TIGHT * way)


@examples(80)
@given(chains(), st.data())
def test_drag_of_a_leg_is_that_of_what_still_falls(chain, data):
    size = chain.rods
    drags = data.draw(st.lists(decades(-6, 0), min_size=size, max_size=size))
    for k, kappa in enumerate(leg_drags(chain, drags)):
        wanted = sum(map(Fraction, drags[k:])) / sum(map(Fraction, chain.masses[k:]))
        assert kappa == float(wanted)


ONE_OR_MANY = st.lists(st.tuples(ALPHAS, GAMMAS, DROPS, GRAVITIES, SPEEDS), min_size=1, max_size=8)


def ends(found):
    """Rows of Δz, V and t."""
    return list(zip(*(row.ravel().tolist() for row in found), strict=True))


def end(chain, alpha, gamma, drop, gravity, speed=0.0):
    found = fall(chain, alpha, gamma, drop, gravity, speed)
    return found.separation_m, found.speed_m_s, found.time_s


@examples(150)
@given(chains(), ONE_OR_MANY)
def test_one_chain_falls_as_it_does_alone(chain, rows):
    alpha, gamma, drop, gravity, speed = map(np.array, zip(*rows, strict=True))
    found = falls(chain.masses, chain.heights, given_impacts(alpha, gamma), drop, gravity, speed)
    assert ends(found) == [end(chain, *row) for row in rows]


def test_arguments_broadcast_and_blocks_do_not_show(monkeypatch):
    monkeypatch.setattr(batch, "_BLOCK", 8)
    chain = even_chain(5)
    assert falls(chain.masses, chain.heights, given_impacts([]), [], 9.81).shape == (3, 0)
    alpha, drop, gravity = [[0.1], [0.2], [0.3]], [0.0, 0.1], [[[9.81]], [[1.62]]]
    found = falls(chain.masses, chain.heights, given_impacts(alpha, 1.5), drop, gravity, 0.5)
    assert found.shape == (3, 2, 3, 2)
    wanted = [
        end(chain, a, 1.5, h, g, 0.5) for g in (9.81, 1.62) for a in (0.1, 0.2, 0.3) for h in drop
    ]
    assert ends(found) == wanted


SURFACES = st.tuples(
    st.one_of(st.sampled_from([0.0, 20.0, 90.0]), st.floats(0.0, 90.0)),
    st.floats(-0.9, 1.0),
    st.one_of(st.just(0.0), st.floats(1e-6, 1.0)),
    st.floats(0.02, 1.2),
    st.floats(0.02, 0.98),
)


def weight_of_a_digit(theta_deg, mu, xi, xi_z):
    """How much the difference in Eq. 13 enlarges the relative error of its terms."""
    theta = math.radians(theta_deg)
    cos, sin = math.cos(theta), math.sin(theta)
    free = 0.25 * (1 + xi) * (1 + 1 / xi_z) * sin / (cos + mu * sin)
    return (cos + free * (sin + mu * cos)) / abs(cos + free * (sin - mu * cos))


@examples(150)
@given(st.lists(SURFACES, min_size=1, max_size=6), st.booleans(), st.booleans())
def test_impacts_are_those_of_one_surface(rows, own_z, piled):
    pile = Pile(20.0, Quantity(-0.37)) if piled else None
    theta, beta, mu, xi, xi_z = zip(*rows, strict=True)
    found = surface_impacts(theta, beta, mu, xi, inertia_z=xi_z if own_z else None, pile=pile)
    for k, row in enumerate(rows):
        chain = replace(even_chain(2), inertia=row[3], inertia_z=row[4] if own_z else None)
        surface = Surface(Quantity(row[1]), Quantity(row[2]), pile)
        weight = weight_of_a_digit(row[0], row[2], row[3], row[4] if own_z else row[3])
        try:
            impact = impact_on(surface, chain, row[0])
        except DomainError:
            assert np.isnan(found.alpha[k]) or weight > 1e14
            continue
        # With ξ > 1 Eq. 8 is negative, and near 1 all its digits are those of 1 − ξ.
        assert found.gamma[k] == impact.gamma
        assert close(found.alpha[k], impact.alpha, 2e-15 * weight) or weight > 1e14
        if abs(row[0] - math.degrees(math.atan(row[2]))) > 1e-12:
            assert found.sliding[k] == ("does not slide" not in "".join(impact.notes))
