"""Samples as columns: wraps are counted, restarts begin anew, a lone tick finds its place."""

from bisect import bisect_left

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.clock.epochs import epochs
from rig.clock.samples import TICK, one_axis, samples
from rig.records import ClockSample, HostBreak
from tests.clock.clocks import HZ, Clock, compared
from tests.examples import examples

WRAP = 2**32
S = 10**9
GAPS = st.one_of(
    st.integers(0, 2 * S),  # as the daemon pings
    st.integers(-100 * S, 20_000 * S),  # a host that began again, and more than can be bridged
)


@st.composite
def conversations(draw):
    """Pings of a board that may restart, at times that may go back, and moments among them."""
    pings, now_ns, count = [], 10**12, draw(st.integers(0, WRAP - 1))
    off = draw(st.floats(-7e-3, 7e-3))  # beyond tolerance, too
    for gap_ns in draw(st.lists(GAPS, max_size=12)):
        now_ns += gap_ns
        count += round(gap_ns * 1e-9 * HZ * (1.0 + off))
        if draw(st.integers(0, 7)) == 0:
            count = draw(st.integers(0, WRAP - 1))
        trip_ns = draw(st.integers(0, 3_000_000))
        pings.append(
            ClockSample(now_ns, now_ns + trip_ns, (count + trip_ns * HZ // (2 * S)) % WRAP)
        )
    moments = [p.host_send_ns + d for p in pings for d in (-1, 0, S)] or [0]
    chosen = st.lists(st.sampled_from(moments), max_size=4)
    breaks = [HostBreak(at, draw(st.integers(0, 9 * S)), 0) for at in draw(chosen)]
    return pings, draw(chosen), breaks


def middle(ping):
    return (ping.host_send_ns + ping.host_recv_ns) // 2


def one_count(last, ping):
    """Wide tick of a sample behind another one, or `None`."""
    expected = (middle(ping) - middle(last)) * 1e-9 * HZ
    trips_ns = ping.host_recv_ns - ping.host_send_ns + last.host_recv_ns - last.host_send_ns
    slack = abs(expected) * 0.006 + trips_ns * 1e-9 * HZ / 2 + 2
    off = (ping.tick - last.tick - round(expected) + WRAP // 2) % WRAP - WRAP // 2
    return last.tick + round(expected) + off if abs(off) <= slack < WRAP / 2 else None


def epochs_one_by_one(pings, cuts_ns):
    found, cuts = [], sorted(cuts_ns)
    for ping in sorted(pings):
        wide = None
        if found:
            last = found[-1][-1]
            cut = bisect_left(cuts, last.host_recv_ns)
            if cut == len(cuts) or cuts[cut] > ping.host_send_ns:
                wide = one_count(last, ping)
        if wide is None:
            found.append([])
        found[-1].append(ping if wide is None else ping._replace(tick=wide))
    return found


def axis_one_by_one(pings, breaks):
    found, lives, before_ns = [], [[(0, 0)]], 0
    for ping in pings:
        shift = lives[-1][-1][1]
        if ping.host_send_ns < before_ns:
            shift += before_ns + 3600 * S - ping.host_send_ns
            lives.append([(0, shift)])
        elif found:
            for one in breaks:
                if before_ns <= one.host_ns <= ping.host_send_ns:
                    shift += one.slept_ns
                    lives[-1].append((one.host_ns, shift))
        before_ns = ping.host_recv_ns
        found.append(ClockSample(ping.host_send_ns + shift, before_ns + shift, ping.tick))
    return found, lives


@examples(150)
@given(conversations())
def test_epochs_and_axis_are_those_of_one_sample_after_the_other(drawn):
    pings, boots, breaks = drawn
    given_samples = samples(pings)
    pieces = epochs(given_samples, HZ, boots).pings
    found = [[ClockSample(*row) for row in piece.tolist()] for piece in pieces]
    assert found == epochs_one_by_one(pings, boots)
    axis = one_axis(given_samples, boots, breaks)
    found = [ClockSample(*row) for row in axis.pings.tolist()]
    lives = [[tuple(stretch) for stretch in life] for life in axis.lives]
    assert (found, lives) == axis_one_by_one(pings, breaks)
    assert (given_samples == samples(pings)).all(), "what was given stays as it is"


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
