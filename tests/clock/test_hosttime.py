"""Samples from before and after sleep, a set clock or a restart of the host are not mixed."""

import pytest

from rig.clock.epochs import epochs
from rig.clock.host import TOLERANCE_NS, HostClocks, HostWatch, read_clocks
from rig.clock.rate import ping_rate
from rig.clock.samples import SEND, one_axis, samples
from rig.records import HostBreak
from tests.clock.clocks import HZ, Clock, compared, moved, ppm

S = 10**9


def rate_of(axis):
    return ping_rate(epochs(axis.pings, HZ, axis.cuts_ns))


@pytest.mark.parametrize("slept", [0.05, 0.7, 30.0, 268.435456 / (1 - 1.3e-3), 4000.0])
def test_a_sleeping_host_spoils_nothing(slept):
    """The monotonic clock stands still meanwhile, the board does not; a whole wrap hides best."""
    clock = Clock(1, last=5000)
    before = compared(clock, 1, 60.0)
    awake = compared(clock, 2, 60.0, begin=100.0 + slept)
    after = [moved(ping, -round(slept * S)) for ping in awake]
    told = one_axis(samples(before + after), breaks=[HostBreak(99 * S, round(slept * S), 0)])
    rate = rate_of(told)
    assert abs(ppm(rate.hz, -1300e-6)) < 3.0
    assert rate.n == len(before) + len(after)
    assert rate.span_s == pytest.approx(120, abs=2)
    assert told.pings[-1, SEND] == after[-1].host_send_ns + round(slept * S)
    if slept == 0.7:  # untold it does show, as a jump or as a rate off by 7 %
        untold = rate_of(one_axis(samples(before + after)))
        assert (
            len(epochs(samples(before + after), HZ).pings) == 2
            or abs(ppm(untold.hz, -1300e-6)) > 100
        )


class Clocks:
    """Clocks of a host that are moved by hand."""

    def __init__(self, boottime=True):
        self.now = HostClocks(5 * S, 7 * S if boottime else None, 10**18)

    def __call__(self):
        return self.now

    def go(self, awake=0.0, slept=0.0, stepped=0.0):
        mono, boot, wall = self.now
        both = round((awake + slept) * S)
        self.now = HostClocks(
            mono + round(awake * S),
            None if boot is None else boot + both,
            wall + both + round(stepped * S),
        )


def test_sleep_and_a_set_clock_are_told_apart():
    clocks = Clocks()
    watch = HostWatch(clocks)
    clocks.go(awake=100.0)
    assert watch.look() is None
    clocks.go(awake=1.0, slept=30.0)
    assert watch.look() == HostBreak(106 * S, 30 * S, 0)
    clocks.go(awake=1.0, stepped=-3600.0)
    assert watch.look() == HostBreak(107 * S, 0, -3600 * S)
    clocks.go(awake=1.0, slept=2.0, stepped=0.5)
    assert watch.look() == HostBreak(108 * S, 2 * S, S // 2)
    assert watch.look() is None


def test_without_a_boot_time_clock_sleep_is_a_step():
    clocks = Clocks(boottime=False)
    watch = HostWatch(clocks)
    clocks.go(awake=1.0, slept=30.0)
    assert watch.look() == HostBreak(6 * S, 0, 30 * S)


def test_what_reading_takes_is_no_break_but_small_steps_add_up():
    clocks = Clocks()
    watch = HostWatch(clocks)
    found = []
    for _ in range(10):
        clocks.go(awake=1.0, stepped=0.4 * TOLERANCE_NS / S)
        found.append(watch.look())
    assert [one is not None for one in found[:3]] == [False, False, True]
    assert sum(one.stepped_ns for one in found if one) == pytest.approx(3.6 * TOLERANCE_NS)


def test_this_hosts_clocks_go_on_as_one():
    watch = HostWatch()
    for _ in range(20):
        assert watch.look() is None
    one, two = read_clocks(), read_clocks()
    assert one.monotonic < two.monotonic
