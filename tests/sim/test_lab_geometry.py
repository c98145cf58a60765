"""Faults of rig and chains: each dial writes its own pattern into the edges, of its own size.

An edge of the free chain that is seen at time t says how high the chain was then, if everything
were perfect: drop + z_rod − g t²/2. What this lacks to the height at which the edge belongs is
the edge's residual, and each fault writes its own pattern into the residuals.
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
from tests.sim.falls import DELAY, PLACES, UNIFORM, ByHand, crossings

G = 9.81
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
    dials = with_dials(rod_sd=0.5e-3)
    a_strikes, b_strikes = truths(dials, 7, (A_STRIKES, 1), (B_STRIKES, 1))
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


def test_gate_errors_belong_to_the_gate_in_every_run():
    dials = with_dials(gate_sd=0.2e-3)
    first, other, again = truths(dials, 3, (A_STRIKES, 1), (B_STRIKES, 1), (A_STRIKES, 9))
    gates = common(residuals(first), 0)
    assert gates == pytest.approx(common(residuals(other), 0), abs=1e-12)
    assert again.edges == first.edges
    assert len({round(off, 9) for off in gates.values()}) == len(gates)
    assert_normal([x for s in range(30) for x in common(one(dials, s), 0).values()], 0.2e-3)


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
