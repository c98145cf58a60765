"""The discrete fall against many-digit and exact rational arithmetic."""

from fractions import Fraction
from itertools import pairwise

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from rig.errors import DomainError
from rig.model.chain import Chain
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
    even_chain,
)
from tests.model.reference import reference_fall

# Twelve legs of a dozen roundings each: 12 × 12 × 2^-53 is 1.6e-14 were all of one sign.
TIGHT = 1e-13


@examples(150)
@given(chains(), ALPHAS, GAMMAS, DROPS, GRAVITIES | st.just(0.0), SPEEDS)
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
@given(chains(), ALPHAS, GAMMAS, DROPS, GRAVITIES, SPEEDS)
def test_hits_tell_the_same_fall(chain, alpha, gamma, drop, gravity, speed):
    gains = kicks(chain, [alpha] * chain.rods, gamma)
    events = hits(chain, gains, drop, gravity, speed)
    end = fall(chain, alpha, gamma, drop, gravity, speed)
    assert len(events) == chain.rods
    assert close(events[-1].time_s, end.time_s, TIGHT)
    assert close(events[-1].speed_before, end.speed_m_s, TIGHT)
    assert events[-1].speed_after == events[-1].speed_before
    start = Fraction(speed)
    assert close(events[0].speed_before ** 2, start**2 + 2 * Fraction(gravity) * Fraction(drop),
                 TIGHT)  # fmt: skip
    for gain, (one, other), (low, high) in zip(
        gains, pairwise(events), pairwise(chain.heights), strict=False
    ):
        assert one.time_s <= other.time_s
        assert close(one.speed_after, Fraction(one.speed_before) * (1 + Fraction(gain)), 4e-16)
        # In between the chain falls freely: v² grows by 2 g times the gap.
        gap = Fraction(high) - Fraction(low)
        grown = Fraction(one.speed_after) ** 2 + 2 * Fraction(gravity) * gap
        assert close(other.speed_before**2, grown, 1e-14)
