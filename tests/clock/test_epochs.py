"""Wide ticks: wraps are counted, restarts begin anew, and a lone tick finds its place."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.clock.epochs import epochs
from rig.clock.samples import TICK, samples
from tests.clock.clocks import HZ, Clock, compared
from tests.examples import examples


@examples(60)
@given(when=st.floats(21.0, 590.0), late=st.floats(0.0, 0.9))
def test_a_tick_finds_its_place_from_about_when_it_was(when, late):
    clock = Clock(7, last=700)
    found = epochs(samples(compared(clock, 7, 20.0)), HZ)
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
    found = epochs(samples(compared(clock, 7, 20.0, begin=5.0)), HZ)
    hz = HZ * (1 - 1.3e-3)
    assert found.place(other.tick(30.0), 30 * 10**9, hz, 0.0, 1.0) is None
    assert found.place(clock.tick(35.0), 30 * 10**9, hz, 0.0, 1.0) is None  # 5 s late
    assert found.place(clock.tick(29.0), 30 * 10**9, hz, 0.0, 1.0) is None  # early
    assert found.place(clock.tick(29.0), 30 * 10**9, hz, 1.2, 0.0) is not None
    assert found.place(clock.tick(1.0), 10**9, hz, 0.0, 1.0) is None  # before all samples
