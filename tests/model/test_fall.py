"""The discrete fall against many-digit arithmetic."""

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from mpmath import mp

from rig.errors import DomainError
from rig.model.chain import Chain
from rig.model.fall import fall, hits, kicks
from tests.examples import examples
from tests.model.air_reference import exact_gains, exact_hits
from tests.model.chains import ALPHAS, DROPS, GAMMAS, GRAVITIES, SPEEDS, chains, close, even_chain
from tests.model.reference import DIGITS, reference_fall

# Twelve legs of a dozen roundings each: 12 × 12 × 2^-53 is 1.6e-14 were all of one sign.
TIGHT = 1e-13
ALL_GRAVITIES = st.one_of(st.just(0.0), GRAVITIES)


@examples(150)
@given(chains(), ALPHAS, GAMMAS, DROPS, ALL_GRAVITIES, SPEEDS)
def test_agrees_with_the_second_implementation(chain, alpha, gamma, drop, gravity, speed):
    assume(gravity or speed)
    end = fall(chain, alpha, gamma, drop, gravity, speed)
    wanted = reference_fall(chain.masses, chain.heights, alpha, gamma, drop, gravity, speed)
    assert close(end.separation_m, wanted.separation, TIGHT)
    assert close(end.speed_m_s, wanted.speed, TIGHT)
    assert close(end.time_s, wanted.time, TIGHT)


@pytest.mark.parametrize("drop", [0.0, 0.18])
def test_without_gravity_or_speed_there_is_no_fall(drop):
    with pytest.raises(DomainError, match="never falls"):
        fall(even_chain(3), 0.1, 1.0, drop, 0.0)


def test_a_speed_beyond_all_floats_is_refused():
    chain = Chain((1e300, 1e300, 1e-300), (0.0, 0.1, 0.2))
    with pytest.raises(DomainError, match="range of numbers"):
        fall(chain, 0.25, 0.0, 0.18, 9.81)


@examples(80)
@given(chains(), st.data(), GAMMAS, DROPS, GRAVITIES, SPEEDS)
def test_every_impact_agrees_with_the_second_implementation(
    chain, data, gamma, drop, gravity, speed
):
    alphas = data.draw(st.lists(ALPHAS, min_size=chain.rods, max_size=chain.rods))
    events = hits(chain, kicks(chain, alphas, gamma), drop, gravity, speed)
    with mp.workdps(DIGITS):
        gains, still = exact_gains(chain.masses, alphas, gamma), [0] * chain.rods
        wanted = exact_hits(chain.heights, gains, still, drop, gravity, speed)
    for found, each in zip(events, wanted, strict=True):
        for value, exact in zip(
            (found.time_s, found.speed_before, found.speed_after), each, strict=True
        ):
            assert close(value, exact, TIGHT)
