"""Wide ticks: wraps are counted, restarts begin anew, and a lone tick finds its place."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.clock.epochs import epochs
from rig.clock.samples import TICK
from rig.records import ClockSample
from tests.clock.clocks import HZ, Clock, compared
from tests.examples import examples

WRAP_S = 2**32 / HZ


def at(tick: int, seconds: float) -> ClockSample:
    return ClockSample(round(seconds * 1e9), round(seconds * 1e9) + 800_000, tick % 2**32)


def test_two_hours_are_27_wraps_and_no_epoch():
    clock = Clock(1, last=7300)
    pings = compared(clock, 1, 7200.0, every=9.0)
    (found,) = epochs(pings, HZ).pings
    ticks = found[:, TICK].tolist()
    assert ticks[-1] - ticks[0] == pytest.approx(7200 * HZ, rel=3e-3)
    assert (ticks[-1] - ticks[0]) // 2**32 == int(7200 * (1 - 1.3e-3) / WRAP_S)
    assert all(a < b for a, b in pairwise(ticks))
    assert all(a % 2**32 == b.tick for a, b in zip(ticks, pings, strict=True))


@examples(60)
@given(
    gap=st.floats(1e-3, 17_000.0),
    off=st.floats(-0.0055, 0.0055),
    start=st.integers(0, 2**32 - 1),
)
def test_the_wraps_of_a_gap_are_exact_within_the_tolerance(gap, off, start):
    passed = round(gap * HZ * (1.0 + off))
    (found,) = epochs([at(start, 1.0), at(start + passed, 1.0 + gap)], HZ).pings
    assert found[1, TICK] - found[0, TICK] == passed


def test_a_restart_begins_an_epoch_whether_it_was_told_or_shows():
    one = compared(Clock(1, last=100), 1, 20.0)
    two = compared(Clock(2, last=100), 2, 20.0, begin=30.0)
    shown = epochs(one + two, HZ)
    assert [len(pings) for pings in shown.pings] == [len(one), len(two)]
    # A board whose counter went on by chance is known to have restarted because it said so.
    same = compared(Clock(1, last=100), 3, 20.0, begin=30.0)
    assert len(epochs(one + same, HZ).pings) == 1
    assert [len(p) for p in epochs(one + same, HZ, [25 * 10**9]).pings] == [len(one), len(same)]


@examples(60)
@given(when=st.floats(21.0, 590.0), late=st.floats(0.0, 0.9))
def test_a_tick_finds_its_place_from_about_when_it_was(when, late):
    clock = Clock(7, last=700)
    found = epochs(compared(clock, 7, 20.0), HZ)
    moment = found.place(clock.tick(when + late), round(when * 1e9), HZ * (1 - 1.3e-3), 0.0, 1.0)
    assert moment is not None
    assert moment.at_ns * 1e-9 == pytest.approx(when + late, abs=1e-2)
    true = (when + late) * (1 - 1.3e-3) * HZ
    first = int(found.pings[0][0, TICK])
    assert moment.tick - first % 2**32 == pytest.approx(
        true - (first - clock.start) % 2**32, abs=200
    )


def test_a_tick_of_another_epoch_or_of_no_time_has_no_place():
    clock, other = Clock(7, last=700), Clock(8, last=700)
    found = epochs(compared(clock, 7, 20.0, begin=5.0), HZ)
    hz = HZ * (1 - 1.3e-3)
    assert found.place(other.tick(30.0), 30 * 10**9, hz, 0.0, 1.0) is None
    assert found.place(clock.tick(35.0), 30 * 10**9, hz, 0.0, 1.0) is None  # 5 s late
    assert found.place(clock.tick(29.0), 30 * 10**9, hz, 0.0, 1.0) is None  # early
    assert found.place(clock.tick(29.0), 30 * 10**9, hz, 1.2, 0.0) is not None
    assert found.place(clock.tick(1.0), 10**9, hz, 0.0, 1.0) is None  # before all samples
