"""The whole motion: against the fall's end, many digits in between, and the ledger of energy."""

import math

import pytest
from hypothesis import given

from rig.model.fall import fall, hits, kicks
from rig.model.impact import alpha_inclined, gamma_finite
from rig.model.motion import Motion
from tests.examples import examples
from tests.model.chains import ALPHAS, DROPS, GAMMAS, GRAVITIES, SPEEDS, chains, close, even_chain
from tests.model.reference import reference_fall

TIGHT = 1e-13
DROP, GRAVITY = 0.18, 9.81


def motion_of(chain, alpha, gamma, drop=DROP, gravity=GRAVITY, speed=0.0):
    return Motion(chain, kicks(chain, [alpha] * chain.rods, gamma), drop, gravity, speed)


PAPERS = motion_of(even_chain(25), alpha_inclined(0.5, 0.2, 40.0), gamma_finite(1 / 3))


@examples(60)
@given(chains(most=8), ALPHAS, GAMMAS, DROPS, GRAVITIES, SPEEDS)
def test_ends_as_the_fall_does(chain, alpha, gamma, drop, gravity, speed):
    motion = motion_of(chain, alpha, gamma, drop, gravity, speed)
    end = motion.at(motion.end_s)
    wanted = fall(chain, alpha, gamma, drop, gravity, speed)
    exact = reference_fall(chain.masses, chain.heights, alpha, gamma, drop, gravity, speed)
    assert end.time_s == motion.end_s
    assert close(motion.end_s, wanted.time_s, TIGHT)
    assert close(end.height_m, -chain.length, TIGHT)
    for found in (wanted.separation_m, exact.separation):
        assert close(end.separation_m, found, TIGHT)
    for found in (wanted.speed_m_s, exact.speed):
        assert close(end.speed_m_s, found, TIGHT)


def test_release_and_impacts():
    release = PAPERS.at(0.0)
    assert (release.height_m, release.speed_m_s, release.separation_m) == (DROP, 0.0, 0.0)
    assert PAPERS.hits == hits(PAPERS.chain, kicks(PAPERS.chain, [alpha_inclined(0.5, 0.2, 40.0)]
                               * 25, gamma_finite(1 / 3)), DROP, GRAVITY)  # fmt: skip
    for hit, rod in zip(PAPERS.hits, PAPERS.chain.heights, strict=True):
        there = PAPERS.at(hit.time_s)
        assert there.height_m == pytest.approx(-rod, rel=1e-14, abs=1e-16)
        assert there.speed_m_s == pytest.approx(hit.speed_after, rel=1e-14)
        before = PAPERS.at(math.nextafter(hit.time_s, 0.0))
        assert before.speed_m_s == pytest.approx(hit.speed_before, rel=1e-13)
        assert before.separation_m == pytest.approx(there.separation_m, rel=1e-12, abs=1e-15)


@pytest.mark.parametrize("time", [-1e-9, math.nextafter(PAPERS.end_s, 1.0), 1.0, math.nan])
def test_there_is_nothing_outside_the_fall(time):
    with pytest.raises(ValueError, match="outside the fall"):
        PAPERS.at(time)
