"""What a resolved fall says of itself, against what its places and speeds say."""

from __future__ import annotations

import numpy as np
import pytest

from sim.resolved.fall import fall
from sim.resolved.hanging import hang
from sim.resolved.scene import Chain, Fall, Strings
from tests.sim.test_resolved import DROP, GRAVITY, MASS, SCENES, WOOD, board, rods

STEP = 2e-6  # so that frames are often


@pytest.fixture(scope="module")
def struck() -> tuple[Chain, Fall]:
    chain = SCENES[1]
    return chain, fall(chain, step=STEP, after=1e-3)


def test_the_top_rod_strikes_where_its_track_is_then(struck):
    _, found = struck
    there = np.interp(found.strike_s, found.times, found.heights[:, -1])
    assert found.touched_height[-1] == pytest.approx(there, abs=1e-6)
    before = found.times < found.strike_s
    slope = np.polyfit(found.times[before][-5:], found.heights[before][-5:, -1], 1)[0]
    assert found.top_speed == pytest.approx(-slope, rel=1e-3)


def test_what_a_rod_pulled_is_what_the_next_one_gained():
    chain = Chain(rods(2, spread=1.0), Strings(), DROP, GRAVITY, board(40.0), WOOD)
    found = fall(chain, step=STEP, after=1e-3)
    gained = MASS * (found.top_speed - GRAVITY * found.strike_s)
    assert gained > 0.0
    assert found.pulled[0] == pytest.approx(gained, rel=1e-3)


def test_the_share_of_slack_strings_is_that_of_the_frames(struck):
    chain, found = struck
    while_striking = (found.frames_s > found.touched_s[0]) & (found.frames_s < found.strike_s)
    places, axes = found.places[while_striking], found.axes[while_striking]
    rest, half = hang(chain).strings.rest, chain.rods.length / 2
    loose = [
        np.linalg.norm(np.diff(places + side * half * axes, axis=2), axis=1) <= rest[:, n]
        for n, side in enumerate((-1.0, 1.0))
    ]
    assert found.slack == pytest.approx(np.mean(loose), abs=0.02)
    assert 0.5 < found.slack < 1.0


def test_how_fast_the_last_rod_turns_is_how_its_axis_moves(struck):
    _, found = struck
    axes = found.axes[found.frames_s < found.strike_s, :, -1].astype(float)
    late = slice(-4, None)
    turned = np.linalg.norm(axes[late][-1] - axes[late][0])
    seconds = np.ptp(found.frames_s[found.frames_s < found.strike_s][late])
    assert found.turning == pytest.approx(turned / seconds, rel=0.02)
    assert found.turning > 0.1
