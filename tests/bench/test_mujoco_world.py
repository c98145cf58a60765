"""Chains in MuJoCo: bounces have the restitution asked for, and falls are those of the scene."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="pip install mujoco")

from bench.studies import mujoco_world
from bench.studies.coverage import draw_rigs, measure
from sim.resolved.fall import fall as resolved_fall
from sim.resolved.scene import Board, Bounce, Chain, Rods, Strings
from tests.analysis.drops import PROTOCOLS


def chain(count: int = 3, **changes: object) -> Chain:
    signs = (-1.0) ** np.arange(count)
    rods = Rods(
        np.full(count, 6e-3), 0.0485 * np.arange(count), np.full(count, 12.7e-3),
        signs * math.radians(12.0), np.zeros(count), np.zeros(count), 0.102,
    )  # fmt: skip
    board = Board(math.radians(45.0), Bounce(0.5, 0.2e-3, 0.2))
    whole = Chain(rods, Strings(), 0.18, 9.81, board, Bounce(0.5, 0.2e-3, 0.3))
    return replace(whole, **changes)


@pytest.mark.parametrize("restitution", [0.1, 0.3, 0.5, 0.9])
def test_damping_gives_the_restitution(restitution):
    """A linear contact that pushes only, in steps of a thousandth of 1/ω."""
    ratio, step = mujoco_world.damping_ratio(restitution), 1e-3
    place, speed = 0.0, 1.0
    while (force := place + 2.0 * ratio * speed) > 0.0:
        speed -= force * step
        place += speed * step
    assert -speed == pytest.approx(restitution, abs=3e-3)


def test_a_chain_falls_freely_until_it_strikes():
    heavy = chain(drag=np.full(3, 0.02))
    found, expected = mujoco_world.fall(heavy), resolved_fall(heavy)
    first = found.touched_s[0]
    assert first == pytest.approx(expected.touched_s[0], abs=1e-5)
    before = found.times < first
    there = np.interp(found.times[before], expected.times, expected.heights[:, -1])
    assert found.heights[before, -1] == pytest.approx(there, abs=1e-6)


def test_what_strikes_pulls_the_top_rod_as_in_the_resolved_world():
    """One impact before the top rod's own: nothing chaotic yet."""
    two = chain(2, touching=None)
    found, expected = mujoco_world.fall(two), resolved_fall(two)
    freely = math.sqrt(2.0 * 9.81 * (0.18 + 0.0485))
    gain = expected.top_speed - freely
    assert gain > 0.05
    assert found.top_speed - freely == pytest.approx(gain, rel=0.25)


def test_a_rig_of_this_world_is_measured():
    rigs = draw_rigs(str(PROTOCOLS), "mujoco", 12, seed=1)
    rig = next(one for one in rigs if one.drops == 1 and "graded" not in one.layout)
    (found,) = measure([rig])
    assert found.verdicts.total() == 1
