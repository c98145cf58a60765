"""The whole motion: against the fall's end, many digits in between, and the ledger of energy."""

from __future__ import annotations

import math
from itertools import accumulate, pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp

from rig.model.chain import Chain
from rig.model.fall import fall, hits, kicks
from rig.model.impact import alpha_inclined, gamma_finite
from rig.model.motion import Motion
from tests.examples import examples
from tests.model.blows import blows
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
from tests.model.reference import reference_fall

TIGHT = 1e-13
SHARES = st.lists(st.floats(0.0, 1.0), min_size=1, max_size=6)
DROP, GRAVITY = 0.18, 9.81
PULLS = st.one_of(st.just(0.0), st.floats(1e-12, 0.5))


def motion_of(chain, alpha, gamma, drop=DROP, gravity=GRAVITY, speed=0.0):
    return Motion(chain, kicks(chain, [alpha] * chain.rods, gamma), drop, gravity, speed)


PAPERS = motion_of(even_chain(25), alpha_inclined(0.5, 0.2, 40.0), gamma_finite(1 / 3))


def blows_of(chain, alpha, gamma, drop=DROP, gravity=GRAVITY, speed=0.0):
    return blows(chain, kicks(chain, [alpha] * chain.rods, gamma), drop, gravity, speed)


def legs_in_many_digits(chain, alpha, gamma, drop, gravity, speed):
    """Of each leg: its beginning, the height, speed and Δz there, how long it takes; v before."""
    g, height = mp.mpf(gravity), mp.mpf(drop)
    time = separation = gained = mp.mpf(0)
    v = mp.mpf(speed)
    found = []
    for k, rod in enumerate(chain.heights):
        arrival = mp.sqrt(v**2 + 2 * g * (height + rod))
        leg = (arrival - v) / g
        found.append((time, height, v, separation, gained, leg))
        time += leg
        separation += gained * leg
        height = -mp.mpf(rod)
        rest = mp.fsum(chain.masses[k + 1 :])
        step = mp.mpf(0)
        if rest:
            step = alpha * arrival * chain.masses[k] / rest / (1 + gamma * chain.masses[k] / rest)
        gained += step
        v = arrival + step
    return found


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


def test_short_legs_at_the_end_of_a_long_fall_keep_their_digits():
    """A tenth of a millimetre takes 2 µs after 4.5 s, less than the clock's last digits allow."""
    chain = Chain((1e6, 1.0, 1e-6), (0.0, 1e-4, 2e-4))
    motion = motion_of(chain, 0.5, 0.0, drop=100.0)
    exact = reference_fall(chain.masses, chain.heights, 0.5, 0.0, 100.0, GRAVITY)
    assert close(motion.at(motion.end_s).separation_m, exact.separation, TIGHT)


@examples(60)
@given(
    chains(most=6, mass_decades=1.0),
    ALPHAS,
    GAMMAS,
    DROPS,
    GRAVITIES,
    SPEEDS,
    st.floats(0.01, 0.99),
)
def test_between_impacts_it_is_the_reference(chain, alpha, gamma, drop, gravity, speed, share):
    motion = motion_of(chain, alpha, gamma, drop, gravity, speed)
    with mp.workdps(120):
        for begin, height, v, separation, gained, leg in legs_in_many_digits(
            chain, alpha, gamma, drop, gravity, speed
        ):
            time = float(begin + share * leg)
            since = time - begin
            if since <= 0 or since >= leg or leg < 1e-9 * begin:
                continue  # the clock has too few digits to be within this leg
            found = motion.at(time)
            loose = TIGHT + 1e-15 * float(begin / since)  # as the clock rounds
            assert close(found.speed_m_s, v + gravity * since, loose)
            assert close(found.separation_m, separation + gained * since, loose)
            fallen = drop - height + (v + gravity * since / 2) * since
            assert close(drop - found.height_m, fallen, loose + TIGHT * float(drop / fallen))


@examples(60)
@given(chains(), ALPHAS, GAMMAS, DROPS, GRAVITIES, SPEEDS, SHARES)
def test_the_chains_only_part(chain, alpha, gamma, drop, gravity, speed, shares):
    motion = motion_of(chain, alpha, gamma, drop, gravity, speed)
    impacts = [hit.time_s for hit in motion.hits]
    before = [math.nextafter(time, 0.0) for time in impacts]
    others = [share * motion.end_s for share in shares]
    times = sorted({0.0, motion.end_s, *impacts, *before, *others})
    seen = [motion.at(time) for time in times]
    size = drop + chain.length
    for one, other in pairwise(seen):
        assert other.separation_m >= one.separation_m
        assert other.speed_m_s >= one.speed_m_s * (1.0 - TIGHT)
        assert other.height_m <= one.height_m + TIGHT * size
    assert seen[0].separation_m == 0.0 or drop == 0.0


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


def test_the_papers_chain_parts_only_after_its_first_impact():
    first = PAPERS.hits[0].time_s
    assert first == pytest.approx(math.sqrt(2 * DROP / GRAVITY), rel=1e-15)
    assert PAPERS.at(first).separation_m == 0.0
    assert PAPERS.at(1.001 * first).separation_m > 0.0
    assert PAPERS.at(PAPERS.end_s).separation_m == pytest.approx(0.11546810526538031, rel=1e-14)


@examples(40)
@given(st.floats(0.0, 1.0))
def test_separation_is_against_a_twin_in_free_fall(share):
    now = PAPERS.at(share * PAPERS.end_s)
    twin = DROP - 0.5 * GRAVITY * now.time_s**2
    assert twin - now.height_m == pytest.approx(now.separation_m, abs=1e-15)


@pytest.mark.parametrize("time", [-1e-9, math.nextafter(PAPERS.end_s, 1.0), 1.0, math.nan])
def test_there_is_nothing_outside_the_fall(time):
    with pytest.raises(ValueError, match="outside the fall"):
        PAPERS.at(time)


def above(chain):
    """M of each rod."""
    return [*list(accumulate(reversed(chain.masses[1:])))[::-1], 0.0]


@examples(80)
@given(chains(), ALPHAS, GAMMAS, DROPS, GRAVITIES, SPEEDS)
def test_the_pulls_are_equation_9_and_make_up_the_speed(chain, alpha, gamma, drop, gravity, speed):
    motion = motion_of(chain, alpha, gamma, drop, gravity, speed)
    ledger = blows_of(chain, alpha, gamma, drop, gravity, speed)
    assert ledger[-1].impulse == 0.0
    gained = 0.0
    for blow, hit, m, rest in zip(ledger, motion.hits, chain.masses, above(chain), strict=True):
        assert (blow.time_s, blow.speed_m_s) == (hit.time_s, hit.speed_before)
        if rest:
            wanted = alpha * m * hit.speed_before / (1.0 + gamma * m / rest)
            assert close(blow.impulse, wanted, TIGHT)
            # What is above goes on with the momentum it had and J.
            momentum = rest * hit.speed_before + blow.impulse
            assert close(rest * hit.speed_after, momentum, TIGHT)
            gained += blow.impulse / rest
    assert close(speed + gravity * motion.end_s + gained, motion.hits[-1].speed_before, TIGHT)


@examples(80)
@given(chains(), ALPHAS, GAMMAS, DROPS, GRAVITIES, SPEEDS, SHARES)
def test_energy_is_what_gravity_has_done(chain, alpha, gamma, drop, gravity, speed, shares):
    """What moves, and what stayed in the rods that struck: the work of gravity on the way.

    A rod that lies there has gone drop + z, all others as far as the chain.
    """
    motion = motion_of(chain, alpha, gamma, drop, gravity, speed)
    ledger = blows_of(chain, alpha, gamma, drop, gravity, speed)
    size = math.fsum(blow.brought + blow.passed_on for blow in ledger)
    start = 0.5 * math.fsum(chain.masses) * speed**2
    for share in shares:
        now = motion.at(share * motion.end_s)
        # At its very end the top rod still moves.
        lying = [hit.time_s <= now.time_s for hit in motion.hits[:-1]]
        moving, gone = [], []
        for rod, (mass, height) in enumerate(zip(chain.masses, chain.heights, strict=True)):
            lies = rod < len(lying) and lying[rod]
            moving.append(0.0 if lies else 0.5 * mass * now.speed_m_s**2)
            gone.append(mass * (drop + height if lies else drop - now.height_m))
        kept = math.fsum(blow.lost for blow, lies in zip(ledger, lying, strict=False) if lies)
        work = gravity * math.fsum(gone)
        # Heights and times are rounded as those of the whole fall are.
        scale = size + gravity * math.fsum(chain.masses) * (drop + chain.length)
        assert abs(math.fsum(moving) + kept - work - start) <= TIGHT * scale
    everything = gravity * math.fsum(
        mass * (drop + z) for mass, z in zip(chain.masses, chain.heights, strict=True)
    )
    assert abs(math.fsum(blow.lost for blow in ledger) - everything - start) <= TIGHT * size


@examples(80)
@given(chains(), PULLS, decades(-3, 0), DROPS, GRAVITIES, SPEEDS)
def test_no_rod_passes_on_more_than_it_brings(chain, alpha, inertia, drop, gravity, speed):
    ledger = blows_of(chain, alpha, gamma_finite(inertia), drop, gravity, speed)
    for blow, mass in zip(ledger, chain.masses, strict=True):
        assert close(blow.brought, 0.5 * mass * blow.speed_m_s**2, TIGHT)
        assert 0.0 <= blow.passed_on <= 2.0 * alpha * blow.brought * (1.0 + TIGHT)
        assert blow.lost >= -TIGHT * blow.brought
    assert blow.lost == blow.brought  # the top rod has nothing to pull on


@pytest.mark.parametrize("gamma", [4 / 3, 1.0, 5.0])
def test_at_half_a_long_chain_loses_nothing(gamma):
    """With r = m/M the bottom rod loses (γ − ¼) r of what it brings, to first order."""
    for rods in (101, 1001, 10001):
        bottom = blows_of(even_chain(rods), 0.5, gamma)[0]
        r = 1.0 / (rods - 1)
        assert bottom.lost / bottom.brought / r == pytest.approx(gamma - 0.25, rel=4 * gamma * r)


def test_above_half_the_ledger_shows_what_is_wrong():
    bottom = blows_of(even_chain(1001), 0.51, 4 / 3)[0]
    assert bottom.lost / bottom.brought == pytest.approx(-0.02, abs=0.002)


def test_the_papers_rods_lose_seven_tenths():
    """α = 0.155: of what a rod far from the top brings, 1 − 2α is lost."""
    ledger = blows_of(PAPERS.chain, alpha_inclined(0.5, 0.2, 40.0), gamma_finite(1 / 3))
    bottom = ledger[0]
    assert bottom.lost / bottom.brought == pytest.approx(1 - 2 * 0.155, abs=0.02)
    assert ledger[-2].lost / ledger[-2].brought > 0.8
