"""What keeps hands and coils whole: outputs, time-outs, silence, emergency stop, cooling."""

import pytest

from rig.link import messages as wire
from rig.link.frames import Frame, encode
from tests.link.bench import LABEL
from tests.link.suite import Suite
from tests.link.talk import Wire, arm, record_drop, release_drop

LONG = {"pulse_us": 100_000, "record_ms": 150}


def later(bench, seconds: float) -> int:
    """Let time pass, and return which releases are on."""
    bench.clock().sleep(seconds)
    return bench.outputs()


class OutputSuite(Suite):
    def test_outputs_are_on_for_the_pulse_and_no_longer(self, bench, device, identity):
        seen = [bench.outputs()]
        token = arm(device, **LONG)
        seen.append(bench.outputs())
        self.refused(wire.RefusalReason.WRONG_TOKEN, device.fire, token ^ 1)
        seen.append(bench.outputs())
        device.fire(token)
        seen.append(bench.outputs())
        seen.append(later(bench, 0.08))
        seen.append(later(bench, 0.04))
        drop = device.collect(LABEL)
        seen.append(bench.outputs())
        assert seen == [0, 0, 0, 1, 1, 0, 0]
        self.close(bench, identity, drop.certificate.pulse_ticks, 0.1)
        assert drop.certificate.restarts == 0

    def test_all_releases_of_a_drop_go_together(self, bench, device, identity):
        if identity.releases < 2:
            pytest.skip("this board has one release")
        device.fire(arm(device, release=0b11, **LONG))
        assert bench.outputs() == 0b11
        assert later(bench, 0.12) == 0

    def test_a_drop_without_release_switches_nothing(self, bench, device, identity):
        device.fire(arm(device, release=0, pulse_us=0))
        assert bench.outputs() == 0
        drop = device.collect(LABEL)
        assert drop.certificate.pulse_ticks == 0
        self.check(bench, drop, identity)

    def test_nothing_is_on_outside_of_a_recording(self, bench, device):
        device.fire(arm(device, pulse_us=80_000, record_ms=40))
        assert later(bench, 0.03) == 1
        assert later(bench, 0.02) == 0

    def test_abort_switches_off(self, bench, device):
        device.fire(arm(device, **LONG))
        device.abort()
        assert bench.outputs() == 0
        (fault,) = device.collect(LABEL).faults
        assert fault.code == "pulse_aborted"

    def test_a_restart_that_nobody_noticed_is_in_the_certificate(self, bench):
        line = Wire(bench)
        causes = 0
        for restart in (bench.brown_out, bench.reset):
            restart()
            heard = line.hear(2.0, until=lambda _, message: isinstance(message, wire.Boot))
            causes |= next(m.cause for _, m in heard if isinstance(m, wire.Boot))
        _, certificate = line.drop()
        assert causes & (wanted := bench.brown_out_cause | 2) == wanted
        assert certificate.restarts & (128 | causes) == 128 | causes, "power-up may be there too"
        line.ask(wire.Acknowledge(certificate.label, certificate.crc32), 3)
        line.ask(wire.Identify(), 4)
        _, certificate = line.drop(release=0, pulse_us=0)
        assert certificate.restarts == 0

    def test_a_reset_switches_off(self, bench, device):
        device.fire(arm(device, **LONG))
        assert later(bench, 0.02) == 1
        bench.reset()
        assert bench.outputs() == 0
        assert later(bench, 0.02) == 0


REQUESTS = wire.Status(), wire.Ping(), wire.Fire(0), wire.Done()
ANEW = [(request, range(2, 7)) for request in REQUESTS]


class SilenceSuite(Suite):
    @pytest.fixture
    def armed(self, bench) -> tuple[Wire, int]:
        """Have a device armed for 5 s; give the line to it and the token."""
        line = Wire(bench)
        return line, line.ask(wire.Arm(LABEL, 1, 0, 0, 5000, 50), 1).token

    @pytest.mark.parametrize(("request_", "seqs"), [*ANEW, (wire.Status(), [2] * 5)])
    def test_any_request_every_100_ms_keeps_it_armed(self, bench, armed, request_, seqs):
        line, token = armed
        for seq in seqs:
            bench.clock().sleep(0.07)
            line.ask(request_, seq)
        assert isinstance(line.ask(wire.Fire(token), 8), wire.Fired)

    @pytest.mark.parametrize(("timeout_ms", "ends_ms"), [(1, 1), (100, 100), (65_535, 250)])
    def test_it_disarms_when_it_says_it_will(self, bench, device, timeout_ms, ends_ms):
        armed_ns = bench.clock().now_ns()
        arm(device, timeout_ms=timeout_ms, record_ms=65_535)
        said = device.wait_for(1.0, lambda got: isinstance(got.message, wire.Disarmed))
        silent = timeout_ms > ends_ms
        assert said.reason == (wire.DisarmReason.HOST_SILENT if silent else 1)
        assert ends_ms <= (bench.clock().now_ns() - armed_ns) * 1e-6 < ends_ms + 25
        assert bench.outputs() == 0

    @pytest.mark.parametrize("frame", ["bad CRC", "seq 0"])
    def test_what_is_no_request_is_silence(self, bench, armed, frame):
        line, _ = armed
        junk = encode(Frame(0x03, 0 if frame == "seq 0" else 5, 0, b""))
        if frame == "bad CRC":
            junk = junk[:1] + bytes([junk[1] ^ 4]) + junk[2:]
        heard = []
        for _ in range(5):
            bench.port().write(junk)
            heard += line.hear(0.08)
        assert heard == [(0, wire.Disarmed(LABEL, wire.DisarmReason.HOST_SILENT))]


def turn(bench, stopped: bool) -> None:
    """Open or close the emergency stop, and wait until it acts."""
    bench.stop(stopped)
    bench.clock().sleep(1e-3)


class StopSuite(Suite):
    def test_an_open_stop_forbids_arming(self, bench, device):
        turn(bench, True)
        assert "emergency stop" in self.refused(wire.RefusalReason.STOPPED, arm, device).message
        self.refused(wire.RefusalReason.STOPPED, arm, device, release=0, pulse_us=0)
        self.refused(wire.RefusalReason.BAD_PARAMETER, arm, device, gates=0)
        bench.lab.hanging = 1
        self.refused(wire.RefusalReason.STOPPED, arm, device)
        bench.lab.hanging = 0
        turn(bench, False)
        device.fire(arm(device))

    def test_opening_it_disarms(self, bench, device):
        token = arm(device)
        bench.stop(True)
        heard = self.heard(bench, device, 0.05)
        assert heard == [wire.Disarmed(LABEL, wire.DisarmReason.STOPPED)]
        error = self.refused(wire.RefusalReason.NOT_ARMED, device.fire, token)
        assert "emergency stop was opened" in error.message
        bench.stop(False)
        self.refused(wire.RefusalReason.NOT_ARMED, device.fire, token)
        assert bench.lab.drops == []

    def test_opening_it_in_a_drop_switches_off_and_records_on(self, bench, device, identity):
        device.fire(arm(device, **LONG))
        assert later(bench, 0.02) == 1
        bench.stop(True)
        assert later(bench, 0.001) == 0
        assert device.status().phase is wire.Phase.RECORDING
        bench.stop(False)
        assert later(bench, 0.001) == 0
        drop = device.collect(LABEL)
        (fault,) = drop.faults
        assert fault.code == "pulse_stopped"
        assert 0.02 <= fault.values["lasting_s"] < 0.03
        self.check(bench, drop, identity, faults=drop.faults)

    @pytest.mark.parametrize("width", [1e-5, 2e-4])
    def test_a_spike_at_it_is_no_stop(self, bench, device, identity, width):
        token = arm(device, **LONG)
        for _ in range(3):
            self.spike(bench, width)
        device.fire(token)
        bench.clock().sleep(0.02)
        self.spike(bench, width)
        drop = device.collect(LABEL)
        self.check(bench, drop, identity)
        assert drop.certificate.pulse_end == wire.PulseEnd.ORDERED

    def spike(self, bench, width):
        bench.stop(True)
        bench.clock().sleep(width)
        turn(bench, False)

    def test_a_drop_is_read_while_it_is_open(self, bench, device):
        drop = record_drop(device)
        bench.stop(True)
        assert device.status().phase is wire.Phase.HOLDING
        release_drop(device, drop)

    def test_a_reset_does_not_close_it(self, bench, device):
        bench.stop(True)
        self.restart(bench, device)
        self.refused(wire.RefusalReason.STOPPED, arm, device)


class CoolingSuite(Suite):
    def test_a_release_rests_for_three_pulses(self, bench, device):
        release_drop(device, record_drop(device, pulse_us=50_000, record_ms=60))
        bench.lab.hanging = 1
        error = self.refused(wire.RefusalReason.COOLING, arm, device)
        assert 80 < error.detail <= 141
        assert f"{error.detail} ms" in error.message
        bench.clock().sleep(0.03)
        assert self.refused(wire.RefusalReason.COOLING, arm, device).detail <= error.detail - 29
        bench.lab.hanging = 0
        arm(device, release=0, pulse_us=0)  # what needs no release need not wait
        device.abort()
        bench.clock().sleep(1.01e-3 * error.detail)
        device.fire(arm(device))

    def test_a_pulse_cut_short_is_a_short_pulse(self, bench, device):
        device.fire(arm(device, **LONG))
        bench.clock().sleep(0.04)
        device.abort()
        release_drop(device, device.collect(LABEL))
        assert 10 < self.refused(wire.RefusalReason.COOLING, arm, device).detail < 180

    def test_an_open_stop_comes_before_cooling(self, bench, device):
        release_drop(device, record_drop(device, pulse_us=50_000, record_ms=60))
        turn(bench, True)
        self.refused(wire.RefusalReason.STOPPED, arm, device)
        turn(bench, False)
        self.refused(wire.RefusalReason.COOLING, arm, device)


class SafetySuite(OutputSuite, SilenceSuite, StopSuite, CoolingSuite):
    """All of it."""
