"""What may be changed without changing the fall, and what moves it one way only."""

from __future__ import annotations

import math
from dataclasses import replace

from hypothesis import assume, given
from hypothesis import strategies as st

from rig.model.chain import Chain
from rig.model.fall import fall, kicks
from rig.model.motion import Motion
from tests.examples import examples
from tests.model.chains import ALPHAS, DROPS, GAMMAS, GRAVITIES, SPEEDS, chains, close, decades

TIGHT = 1e-13


@examples(80)
@given(chains(), ALPHAS, GAMMAS, DROPS, GRAVITIES, GRAVITIES)
def test_separation_does_not_depend_on_gravity(chain, alpha, gamma, drop, here, there):
    one, other = (fall(chain, alpha, gamma, drop, gravity) for gravity in (here, there))
    root = math.sqrt(there / here)
    assert close(one.separation_m, other.separation_m, TIGHT)
    assert close(one.speed_m_s * root, other.speed_m_s, TIGHT)
    assert close(one.time_s / root, other.time_s, TIGHT)


@examples(80)
@given(chains(), ALPHAS, GAMMAS, DROPS, GRAVITIES, SPEEDS, st.integers(-20, 20))
def test_gravity_can_be_traded_for_time(chain, alpha, gamma, drop, gravity, speed, n):
    """A clock that runs 2^n times as fast: g by 4^n and speeds by 2^n, not a bit is rounded."""
    one = fall(chain, alpha, gamma, drop, gravity, speed)
    other = fall(chain, alpha, gamma, drop, gravity * 4.0**n, speed * 2.0**n)
    assert other.separation_m == one.separation_m
    assert other.speed_m_s == one.speed_m_s * 2.0**n
    assert other.time_s == one.time_s / 2.0**n


@examples(80)
@given(chains(), ALPHAS, GAMMAS, DROPS, GRAVITIES, SPEEDS, decades(-9, 9), st.integers(-60, 60))
def test_only_ratios_of_masses_matter(chain, alpha, gamma, drop, gravity, speed, scale, power):
    one = fall(chain, alpha, gamma, drop, gravity, speed)
    doubled = replace(chain, masses=tuple(m * 2.0**power for m in chain.masses))
    assert fall(doubled, alpha, gamma, drop, gravity, speed) == one
    scaled = replace(chain, masses=tuple(m * scale for m in chain.masses))
    other = fall(scaled, alpha, gamma, drop, gravity, speed)
    assert close(one.separation_m, other.separation_m, TIGHT)
    assert close(one.speed_m_s, other.speed_m_s, TIGHT)
    assert close(one.time_s, other.time_s, TIGHT)


@examples(80)
@given(chains(), ALPHAS, GAMMAS, DROPS, GRAVITIES, st.integers(-15, 15))
def test_a_larger_scene_is_the_same_scene(chain, alpha, gamma, drop, gravity, n):
    """All lengths by 4^n: Δz by 4^n, V and t by 2^n, exactly."""
    one = fall(chain, alpha, gamma, drop, gravity)
    larger = replace(chain, heights=tuple(z * 4.0**n for z in chain.heights))
    other = fall(larger, alpha, gamma, drop * 4.0**n, gravity)
    assert other.separation_m == one.separation_m * 4.0**n
    assert other.speed_m_s == one.speed_m_s * 2.0**n
    assert other.time_s == one.time_s * 2.0**n


@examples(80)
@given(chains(), ALPHAS, GAMMAS, decades(-3, 2), GRAVITIES, st.floats(0.0, 1.0))
def test_the_drop_can_be_cut_in_two(chain, alpha, gamma, drop, gravity, share):
    """Released higher, or on its way already as it passes a lower place: the same fall."""
    lower = drop * share
    passing = math.sqrt(2.0 * gravity * (drop - lower))
    whole = fall(chain, alpha, gamma, drop, gravity)
    rest = fall(chain, alpha, gamma, lower, gravity, passing)
    assert close(rest.separation_m, whole.separation_m, TIGHT)
    assert close(rest.speed_m_s, whole.speed_m_s, TIGHT)
    assert close(rest.time_s + passing / gravity, whole.time_s, TIGHT)


@examples(80)
@given(chains(), ALPHAS, GAMMAS, DROPS, GRAVITIES, SPEEDS, st.data())
def test_a_rod_without_mass_changes_nothing(chain, alpha, gamma, drop, gravity, speed, data):
    at = data.draw(st.integers(1, chain.rods - 1))
    low, high = chain.heights[at - 1 : at + 1]
    z = low + (high - low) * data.draw(st.floats(0.01, 0.99))
    longer = Chain(
        (*chain.masses[:at], 0.0, *chain.masses[at:]), (*chain.heights[:at], z, *chain.heights[at:])
    )
    one = fall(chain, alpha, gamma, drop, gravity, speed)
    other = fall(longer, alpha, gamma, drop, gravity, speed)
    assert close(one.separation_m, other.separation_m, TIGHT)
    assert close(one.speed_m_s, other.speed_m_s, TIGHT)
    assert close(one.time_s, other.time_s, TIGHT)


@examples(80)
@given(chains(), ALPHAS, GAMMAS, DROPS, GRAVITIES, decades(-3, 1))
def test_a_stronger_pull_is_never_slower(chain, alpha, gamma, drop, gravity, more):
    """Greater α: faster at every height, so earlier, so further ahead of the twin."""
    # Two rods with the lower one at rest on the surface: nothing is struck at any speed.
    assume(chain.rods > 2 or drop > 0.0)
    weak = fall(chain, alpha, gamma, drop, gravity)
    strong = fall(chain, alpha * (1.0 + more), gamma, drop, gravity)
    assert 0.0 < weak.separation_m < strong.separation_m < drop + chain.length
    assert weak.speed_m_s <= strong.speed_m_s * (1.0 + TIGHT)
    assert strong.time_s <= weak.time_s * (1.0 + TIGHT)


@examples(80)
@given(chains(), ALPHAS, GAMMAS, decades(-3, 2), DROPS, GRAVITIES)
def test_a_larger_gamma_weakens_the_pull(chain, alpha, gamma, more, drop, gravity):
    firm = fall(chain, alpha, gamma, drop, gravity)
    loose = fall(chain, alpha, gamma + more, drop, gravity)
    assert loose.separation_m <= firm.separation_m * (1.0 + TIGHT)
    assert loose.speed_m_s <= firm.speed_m_s * (1.0 + TIGHT)
    assert firm.time_s <= loose.time_s * (1.0 + TIGHT)


@examples(80)
@given(chains(mass_decades=2), ALPHAS, GAMMAS, decades(-3, 1), GRAVITIES, SPEEDS, st.floats(0, 1))
def test_the_fall_can_be_cut_anywhere(chain, alpha, gamma, drop, gravity, speed, share):
    """What has not struck yet, let go again where it is and as fast as it is, ends the fall."""
    whole = fall(chain, alpha, gamma, drop, gravity, speed)
    motion = Motion(chain, kicks(chain, [alpha] * chain.rods, gamma), drop, gravity, speed)
    here = motion.at(share * motion.end_s)
    struck = sum(hit.time_s <= here.time_s for hit in motion.hits[:-1])
    lowest = chain.heights[struck]
    rest = Chain(chain.masses[struck:], tuple(z - lowest for z in chain.heights[struck:]))
    left = max(0.0, here.height_m + lowest)  # at the cut itself rounding may put it below 0
    end = fall(rest, alpha, gamma, left, gravity, here.speed_m_s)
    assert close(end.speed_m_s, whole.speed_m_s, TIGHT)
    # Heights are differences here: what they lose counts against the whole way, and in time as
    # that way takes at the speed of the next impact.
    way = drop + chain.length
    lost = TIGHT * (whole.time_s + way / motion.hits[struck].speed_before)
    assert abs(here.time_s + end.time_s - whole.time_s) <= lost
    # The twin is slower by what was gained so far, and goes on falling behind at that rate.
    twin = speed + gravity * here.time_s
    separation = here.separation_m + (here.speed_m_s - twin) * end.time_s + end.separation_m
    assert abs(separation - whole.separation_m) <= TIGHT * way + (here.speed_m_s + twin) * lost
