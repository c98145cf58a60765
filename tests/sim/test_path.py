"""The way down: heights and times of a falling chain, both ways round."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp

from rig.model.chain import Chain
from rig.model.drag import drag_hits, drag_leg
from rig.model.fall import kicks
from sim.path import Path


@st.composite
def paths(draw) -> Path:
    """Any chain on its way down, with impacts of any strength."""
    rods = draw(st.integers(1, 30))
    lists = {"min_size": rods, "max_size": rods}
    gaps = draw(st.lists(st.floats(0.002, 0.1), **lists))
    chain = Chain(
        masses=tuple(draw(st.lists(st.floats(0.05, 20), **lists))),
        heights=tuple(math.fsum(gaps[1 : k + 1]) for k in range(rods)),
    )
    alphas = draw(st.lists(st.floats(-0.2, 0.5), **lists))
    start = draw(st.floats(0.001, 2))
    gravity = draw(st.floats(0.5, 30))
    gains = kicks(chain, alphas, draw(st.floats(0, 3)))
    # No impact throws the chain back up: only then is there one time for each height.
    gains = [max(gain, -0.5) for gain in gains]
    kappas = draw(st.one_of(st.just([]), st.lists(st.floats(1e-4, 0.3), **lists)))
    events = drag_hits(chain, gains, kappas or [0.0] * rods, start, gravity)
    heights = tuple(-z for z in chain.heights)
    return Path(draw(st.floats(0, 1)), start, gravity, events, heights, kappas)


@given(paths(), st.floats(0, 1))
def test_height_undoes_time(path, part):
    low, high = path.hit_heights[-1] - 0.3, path.start
    height = low + part * (high - low)
    assert path.height_at(path.time_at(height)) == pytest.approx(height, abs=1e-12)


@given(paths(), st.floats(0, 1.3))
def test_time_undoes_height(path, part):
    # In the first millisecond the speed is too small for a height to tell the time.
    time = path.release_s + 1e-3 + part * path.hits[-1].time_s
    assert path.time_at(path.height_at(time)) == pytest.approx(time, abs=1e-11)


@given(st.floats(0.1, 3), st.floats(0.5, 30), st.floats(1e-3, 1.0), st.floats(1e-3, 1.5))
def test_a_free_fall_in_air_is_the_logarithm_of_a_cosh(start, gravity, kappa, since):
    path = Path(0.02, start, gravity, kappas=[kappa])
    with mp.workdps(40):
        x = mp.sqrt(mp.mpf(kappa) * gravity) * ((0.02 + since) - 0.02)
        fallen = float(mp.log(mp.cosh(x)) / kappa)
    assert path.height_at(0.02 + since) == pytest.approx(start - fallen, abs=1e-12)


@given(paths(), st.floats(1e-3, 0.05))
def test_the_last_rod_above_and_below_its_hit_falls_freely(path, way):
    speed, kappa = path.hits[-1].speed_before, [0.0, *path.kappas][-1]
    late, there = path.last_at(way)
    if there:  # it once was so high
        assert drag_leg(way, there, path.gravity, kappa) == pytest.approx((speed, -late))
    late, there = path.last_at(-way)
    assert (there, late) == pytest.approx(drag_leg(way, speed, path.gravity, kappa))
