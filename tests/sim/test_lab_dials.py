"""Chance and faults of the simulated rig: each dial writes its own pattern, of its own size.

An edge of the free chain that is seen at time t says how high the chain was then, if everything
were perfect: drop + z_rod − g t²/2. What this lacks to the height at which the edge belongs is
the edge's residual, and each fault of the geometry writes its own pattern into the residuals.
"""

import math
from collections import defaultdict

import numpy as np
import pytest

from sim.beam import NOT_A_ROD
from sim.dials import Dials
from sim.lab import ChainLab
from sim.truth import Truth
from tests.sim.chance import (
    A_STRIKES,
    B_STRIKES,
    FEW_GATES,
    FREE,
    SIGMAS,
    assert_normal,
    attempts,
    truths,
    with_dials,
)
from tests.sim.falls import DELAY, PLACES, RODS, UNIFORM, WITHOUT_GATES, ByHand, alpha, crossings

G = 9.81


def times(truth: Truth) -> dict[tuple[int, int, bool], float]:
    """When each edge came, by channel, rod and level."""
    return {(channel, rod, blocked): time for time, channel, blocked, rod in truth.edges}


def test_a_positive_skew_is_a_free_chain_that_leaves_later():
    (quiet,) = attempts(with_dials(), 1, FEW_GATES)
    undisturbed = times(quiet)
    drops = attempts(with_dials(skew_sd=4e-3), 300, FEW_GATES)
    fall = float(ByHand.at(40).times[-1])
    for truth in drops:
        skew, seen = truth.release_skew_s, times(truth)
        assert seen.keys() == undisturbed.keys()
        for edge, time in seen.items():
            late = pytest.approx(skew, abs=1e-12) if edge[0] in FREE else 0.0
            assert time - undisturbed[edge] == late
        # At the hit the free chain has fallen for `fall - skew`: later means higher.
        raised = G * fall * skew - G * skew**2 / 2
        assert truth.separation_raw_m - truth.separation_m == pytest.approx(raised, abs=1e-12)
        assert truth.separation_m == pytest.approx(quiet.separation_m, rel=1e-12)
    assert pytest.approx(4.9e-3, rel=0.01) == G * fall * 1e-3  # 4.9 mm a millisecond
    assert_normal([t.release_skew_s for t in drops], 4e-3)


def test_the_top_rod_strikes_what_lies_there():
    drops = attempts(with_dials(strike_sd=5e-3), 300, FEW_GATES)
    above = []
    for truth in drops:
        end, strike = truth.speed_m_s, truth.speed_strike_m_s
        above.append((end**2 - strike**2) / (2 * G))
        # While the rod would fall on, the free chain comes nearer with the speed that it has then.
        early = 2 * above[-1] / (end + strike)
        free = G * (truth.fall_time_s - 0.5 * early)
        higher = free * early - above[-1]
        assert truth.separation_strike_m == pytest.approx(truth.separation_m + higher, rel=1e-9)
    assert_normal(above, 5e-3)


def test_single_impulses_scatter_independently_by_the_dial():
    sd, wiggle = 0.02, 1e-6
    a = alpha(40)
    level = ByHand([a] * RODS).separation
    slopes = [
        float(ByHand([a * (1 + wiggle * (k == rod)) for k in range(RODS)]).separation - level)
        / wiggle
        for rod in range(RODS)
    ]
    drops = attempts(with_dials(impulse_sd=sd), 300, WITHOUT_GATES)
    assert_normal([t.separation_m - float(level) for t in drops], sd * math.hypot(*slopes))


def test_the_string_flickers_in_gaps_between_rods():
    quiet = attempts(with_dials(), 1)[0]
    truth = attempts(with_dials(string=1.0), 1)[0]
    flickers = [edge for edge in truth.edges if edge[3] == NOT_A_ROD]
    for channel in (gate.channel for gate in UNIFORM.gates.gates):
        rods = {rod for _, at, _, rod in quiet.edges if at == channel}
        begun = [edge for edge in flickers if edge[1] == channel and edge[2]]
        # A flicker that runs into the next rod ends with it; it still begins by itself.
        assert len(begun) == len(rods) - 1
        gaps = [edge for edge in quiet.edges if edge[1] == channel][1:-1]
        for (time, *_), (last, *_), (following, *_) in zip(
            begun, gaps[::2], gaps[1::2], strict=True
        ):
            assert last < time < following


HALF_WIDTH = 0.0127 / math.cos(math.radians(12)) / 2
SPACING = 1.165 / 24
HEIGHT = {gate.channel: gate.height for gate in UNIFORM.gates.gates}

Residuals = dict[tuple[int, int, bool], float]  # by channel, rod, blocked


def residuals(truth: Truth, *, free: bool = True, until: float = math.inf) -> Residuals:
    """Of one side's rod edges, m; for the impact side only before the first hit."""
    found: Residuals = {}
    for time, channel, blocked, rod in truth.edges:
        if rod != NOT_A_ROD and (channel in FREE) == free and time < until:
            seen = 0.18 + rod * SPACING - G * (time - DELAY) ** 2 / 2
            belongs = HEIGHT[channel] + (HALF_WIDTH if blocked else -HALF_WIDTH)
            found[channel, rod, blocked] = seen - belongs
    assert found
    return found


def one(dials: Dials, seed: int = 1, run: int = A_STRIKES, attempt: int = 1) -> Residuals:
    return residuals(truths(dials, seed, (run, attempt))[0])


def common(values: Residuals, *key: int) -> dict:
    """The residuals' common value for each part of their key; there must be one."""
    groups = defaultdict(list)
    for where, value in values.items():
        groups[tuple(where[i] for i in key)].append(value)
    for group in groups.values():
        assert max(group) - min(group) < 1e-11
    return {where: group[0] for where, group in groups.items()}


def test_a_chain_strikes_with_its_own_rods():
    a_strikes, b_strikes = truths(with_dials(rod_sd=0.5e-3), 7, (A_STRIKES, 1), (B_STRIKES, 1))
    # Each chain's rods where it falls freely …
    b_map, a_map = (common(residuals(t), 1) for t in (a_strikes, b_strikes))
    a_places = [place - a_map[k,] for k, place in enumerate(PLACES)]
    # … say when it strikes, and what that does to the other edges.
    by_hand = ByHand.at(40, a_places)
    for gate in UNIFORM.gates.on("impact"):
        expected = crossings(gate.height, by_hand.time_down, a_places)
        seen = [edge for edge in a_strikes.edges if edge[1] == gate.channel]
        assert [edge[2:] for edge in seen] == [edge[1:] for edge in expected]
        times = [DELAY + edge[0] for edge in expected]
        assert [edge[0] for edge in seen] == pytest.approx(times, abs=1e-11)
    assert a_strikes.speed_m_s == pytest.approx(float(by_hand.before[-1]), rel=1e-10)
    # Δz is between the two top rods, each at its own place.
    b_top = 0.18 + 1.165 - b_map[24,]
    fallen = G * float(by_hand.times[-1]) ** 2 / 2
    assert a_strikes.separation_m == pytest.approx(b_top - fallen, abs=1e-11)


def test_a_wider_rod_blocks_earlier_and_frees_later():
    dials = with_dials(width_sd=0.1e-3)
    off = common(one(dials), 2)
    assert off[True,] == pytest.approx(-off[False,], abs=1e-12)
    assert one(dials) == pytest.approx(one(dials, 1, A_STRIKES + 3, 5), abs=1e-12)
    labs = [ChainLab(UNIFORM, dials, seed) for seed in range(1, 301)]
    wider = [[b.widths - 2 * HALF_WIDTH for b in lab.bodies.values()] for lab in labs]
    assert off[True,] == pytest.approx(wider[0][1][0] / 2, abs=1e-12)  # B falls freely
    assert np.ptp(wider, axis=2).max() < 1e-12  # all rods of a chain alike
    assert_normal(np.array(wider)[:, :, 0].ravel(), 0.1e-3)


def test_hanging_heights_scatter_from_drop_to_drop_and_side_to_side():
    drops = attempts(with_dials(hang_sd=0.1e-3), 300, FEW_GATES)
    free = [common(residuals(t))[()] for t in drops]
    struck = [common(residuals(t, free=False, until=DELAY + 0.19))[()] for t in drops]
    assert_normal(free, 0.1e-3)
    assert_normal(struck, 0.1e-3)
    together = np.mean(np.array(free) * struck) / 0.1e-3**2
    assert abs(together) < SIGMAS / math.sqrt(300)  # the sides hang independently
