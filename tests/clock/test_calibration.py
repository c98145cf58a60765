"""The host's breaks and the 1 Hz reference: seconds from pulses, whatever becomes of one."""

from unittest.mock import Mock

import pytest

from rig.clock.calibration import Calibrator
from rig.clock.epochs import epochs
from rig.clock.host import TOLERANCE_NS, HostClocks, HostWatch, read_clocks
from rig.clock.rate import ping_rate, pulse_rate
from rig.clock.samples import SEND, one_axis, samples
from rig.link import messages as wire
from rig.link.transcript import Transcript
from rig.records import ClockSample, HostBreak, Pulse
from tests.clock.clocks import HZ, Clock, compared, moved, ppm, seconds
from tests.link.talk import framed

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
    assert (rate.n, rate.span_s) == (len(before) + len(after), pytest.approx(120, abs=2))
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
        self.now = HostClocks(5 * S, 7 * S if boottime else 5 * S, 10**18)

    def __call__(self):
        return self.now

    def go(self, awake=0.0, slept=0.0, stepped=0.0):
        mono, boot, wall = self.now
        both = round((awake + slept) * S)
        later = mono + round(awake * S)
        boot = later if boot == mono else boot + both
        self.now = HostClocks(later, boot, wall + both + round(stepped * S))


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


def measured(clock, pulses, pings=None):
    split = epochs(samples(pings or compared(clock, 1, 120.0)), HZ)
    return pulse_rate(split, pulses, ping_rate(split))


@pytest.mark.parametrize("every", [1, 7, 10])
def test_a_minute_of_pulses_gives_the_rate_to_parts_in_a_thousand_million(every):
    """Worst case: a tick lost at both ends, 2/(16e6·50) = 2.5 parts in 10⁹."""
    for seed in range(20):
        clock = Clock(seed, last=200)
        pulses = seconds(clock, 10, 61)[::every]
        rate = measured(clock, pulses, compared(clock, seed, 120.0))
        assert rate.n == len(pulses)
        assert abs(ppm(rate.hz, -1300e-6)) < 2.6e-3
        assert abs(ppm(rate.hz, -1300e-6)) < 4.0 * rate.u_hz / HZ * 1e6 < 0.02


def test_the_error_of_the_reference_is_that_of_the_rate():
    clock = Clock(1, last=200)
    rate = measured(clock, seconds(clock, 10, 60, ppm=0.5))
    assert ppm(rate.hz, -1300e-6) == pytest.approx(-0.5, abs=5e-3)


def test_the_count_may_wrap_and_the_same_pulse_be_told_twice():
    clock = Clock(2, last=200)
    pulses = seconds(clock, 10, 60, number=65_510)
    rate = measured(clock, pulses + [moved(pulse, 10**8) for pulse in pulses])
    assert rate.n == 60
    assert abs(ppm(rate.hz, -1300e-6)) < 3e-3


def test_between_two_pulses_the_count_may_wrap():
    """A count of 16 bits is told apart by the host's time, a night without pulses later too."""
    clock = Clock(6, last=70_100)
    pulses = [pulse for at in (10, 70_010) for pulse in seconds(clock, at, 30, number=at)]
    rate = measured(clock, pulses, compared(clock, 6, 70_100.0, 40.0))
    assert (rate.n, rate.span_s) == (60, pytest.approx(70_029.0, abs=0.1))
    assert abs(ppm(rate.hz, -1300e-6)) < 1e-4


def test_a_missed_pulse_and_one_too_many_begin_new_stretches():
    clock = Clock(3, last=200)
    pulses = seconds(clock, 10, 60)
    missed = [p if n < 30 else p._replace(number=p.number - 1) for n, p in enumerate(pulses)]
    surplus = [p if n < 30 else p._replace(number=p.number + 1) for n, p in enumerate(pulses)]
    for wrong in (missed, surplus):
        rate = measured(clock, wrong)
        assert (rate.n, rate.span_s) == (60, pytest.approx(58.0, abs=0.1))
        assert abs(ppm(rate.hz, -1300e-6)) < 5e-3


def test_a_reference_that_was_taken_away_says_nothing_more():
    clock = Clock(4, last=200)
    pulses = seconds(clock, 10, 20)
    stale = [moved(pulses[-1], n * 10**9) for n in range(2, 61)]
    rate = measured(clock, pulses + stale)
    assert (rate.n, rate.span_s) == (20, pytest.approx(19.0, abs=0.1))


def test_noise_on_the_input_is_no_reference():
    """Pulses at ten times the rate agree with no count of seconds."""
    clock = Clock(5, last=200)
    pulses = [p._replace(number=10 * p.number) for p in seconds(clock, 10, 60)]
    rate = measured(clock, pulses)
    assert (rate.n, rate.hz) == (0, HZ)


def test_a_restart_of_the_board_begins_a_new_stretch():
    one, two = Clock(6, last=200), Clock(7, last=200)
    pings = compared(one, 1, 60.0) + compared(two, 2, 60.0, begin=70.0)
    pulses = seconds(one, 5, 50) + seconds(two, 75, 50)
    rate = measured(one, pulses, pings)
    assert (rate.n, rate.span_s) == (100, pytest.approx(98.0, abs=0.1))
    assert abs(ppm(rate.hz, -1300e-6)) < 5e-3


def talk(*parts):
    """Feed messages in turn; requests have seq 1, 2, …."""
    transcript, found, seq = Transcript(), [], 0
    for n, (direction, message, new) in enumerate(parts):
        seq += direction == "tx" and new
        numbers = (seq, 0) if direction == "tx" else (n + 1, seq)
        records = transcript.feed(direction, 1000 * n, framed(message, *numbers))
        found += [record for record in records if isinstance(record, ClockSample | Pulse)]
    return found


def test_pulses_come_out_of_the_bytes_and_repeats_do_not():
    ask, answer = wire.Reference(), wire.ReferencePulse(12, 6_500_000)
    assert talk(("tx", ask, True), ("rx", answer, True)) == [Pulse(0, 1000, 12, 6_500_000)]
    assert talk(("tx", ask, True), ("tx", ask, False), ("rx", answer, True)) == []
    # What is not wired has no pulse.
    assert talk(("tx", ask, True), ("rx", wire.ReferencePulse(0, 0), True)) == []
    ping, pong = wire.Ping(), wire.Pong(77)
    assert talk(("tx", ping, True), ("tx", ping, False), ("rx", pong, True)) == []
    both = talk(("tx", ping, True), ("rx", pong, True), ("tx", ask, True), ("rx", answer, True))
    assert both == [ClockSample(0, 1000, 77), Pulse(2000, 3000, 12, 6_500_000)]


def log_of(pings=(), pulses=(), *, simulated=False):
    """Give what a session has recorded of clocks until now."""
    board = {"tick_hz": HZ}
    log = Mock(simulated=simulated, **{"identities.return_value": [(0, board)]})
    log.pings.side_effect = lambda after=0: pings[after:]
    log.pulses.return_value, log.host_breaks.return_value = pulses, []
    return log


def test_without_samples_the_rate_is_the_one_that_the_board_states():
    clock = Calibrator().look(log_of(), 1e-7)
    assert clock.device.hz == HZ
    assert (clock.said["source"], clock.details["samples"]) == ("stated", 0)
    assert not {"pings", "pulses", "clock_u_ppm"} & clock.said.keys()


def test_a_real_host_is_believed_no_further_than_its_quartz():
    """50 ppm/√3 of a computer's clock; a simulated one is exact."""
    pings = compared(Clock(8, last=200), 1, 120.0)
    exact, real = (
        Calibrator().look(log_of(pings, simulated=simulated), 1e-7).device
        for simulated in (True, False)
    )
    assert exact.u < 2e-6
    assert real.u == pytest.approx(50e-6 / 3**0.5, rel=0.01)
    assert real.hz == exact.hz


def test_looking_again_while_a_session_grows_gives_what_looking_once_gives():
    clock = Clock(9, last=200)
    pings, pulses = compared(clock, 1, 120.0), seconds(clock, 10, 60)
    calibrator = Calibrator()
    for count in (0, 1, 2, 9, 10, len(pings)):
        log = log_of(pings[:count], pulses if count > 9 else [])
        again, once = calibrator.look(log, 1e-7), Calibrator().look(log, 1e-7)
        assert (again.said, again.device) == (once.said, once.device)
    assert again.said["source"] == "reference"
