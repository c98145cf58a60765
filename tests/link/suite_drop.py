"""Who is there; a drop from arming to acknowledging, how it is held, and what forbids it."""

from rig.errors import DeviceError
from rig.link import messages as wire
from rig.selftest.board import SelftestOptions
from rig.selftest.findings import Verdict
from rig.selftest.run import selftest
from tests.link.bench import GATES, LABEL
from tests.link.suite import Suite
from tests.link.talk import Wire, arm, record_drop, release_drop
from tests.refusals import refused

NEEDS_HANDS = {"GATE_BLOCKED", "sync output to gate", "GATE_UNSTEADY", "STOPPED", "NOT_KEPT"}


class CheckSuite(Suite):
    def test_it_passes_the_self_test(self, bench):
        findings = list(selftest(bench.port(), SelftestOptions(release=True)))
        assert [str(one) for one in findings if one.verdict is Verdict.FAILED] == []
        assert {one.name for one in findings if one.verdict is not Verdict.OK} == NEEDS_HANDS


class DropSuite(Suite):
    def test_idle_state(self, bench, device):
        bench.touch(0x0201)
        state = device.status()
        assert (state.phase, state.label, state.events) == (wire.Phase.IDLE, 0, 0)
        assert state.gates & GATES == 0x0201

    def test_a_drop_comes_whole_and_exact(self, bench, device, identity):
        drop = record_drop(device)
        self.check(bench, drop, identity)
        assert (drop.run, drop.attempt, drop.certificate.release_sense) == (7, 1, None)
        assert bench.lab.drops == [LABEL]
        release_drop(device, drop)
        assert device.status().phase is wire.Phase.IDLE

    def test_only_armed_gates_are_recorded(self, bench):
        events, certificate = Wire(bench).drop(gates=0x0002)
        assert len(events) == certificate.events == 20
        assert {event.state for event in events} == {0, 2}
        assert certificate.glitches == 0

    def test_a_blocked_gate_that_is_not_armed_does_not_matter(self, bench, device, identity):
        bench.lab.hanging = 0x0800
        self.check(bench, record_drop(device), identity)

    def test_the_32_bit_time_may_wrap_within_a_drop(self, bench, device, identity):
        bench.preset_tick(seconds_before_wrap=0.05)
        arm(device)
        device.fire(arm(device))  # arming again while armed is allowed
        drop = device.collect(LABEL)
        assert drop.fire_tick > 2**32 - 0.06 * identity.tick_hz
        self.check(bench, drop, identity)


class InputSuite(Suite):
    def test_reference_pulses_are_counted_and_timed(self, bench, device, identity):
        assert device.reference() == wire.ReferencePulse(0, 0)
        bench.reference([0.05, 0.15, 0.25])
        bench.clock().sleep(0.1)
        first = device.reference()
        assert first.count == 1
        assert device.reference() == first
        bench.clock().sleep(0.2)
        third = device.reference()
        assert third.count == 3
        self.close(bench, identity, (third.tick - first.tick) % 2**32, 0.2)
        now = device.ping().tick
        assert (now - third.tick) % 2**32 < 0.2 * identity.tick_hz

    def test_the_release_sense_is_timed(self, sensing, device, identity):
        sensing.sense(0.012)
        drop = record_drop(device)
        self.check(sensing, drop, identity)
        self.close(sensing, identity, drop.certificate.release_sense, 0.012)

    def test_a_change_behind_the_recording_is_not_of_the_drop(self, sensing, device):
        sensing.sense(0.1)
        assert record_drop(device, record_ms=50).certificate.release_sense is None


class RefusalSuite(Suite):
    def test_the_longest_pulse_of_all_gates_and_the_last_release_is_armed(self, device, identity):
        every, last = (1 << identity.gates) - 1, 1 << identity.releases - 1
        arm(device, gates=every, release=last, pulse_us=identity.max_pulse_us, record_ms=1)

    def test_a_gate_blocked_after_arming_forbids_fire(self, bench, device):
        token = arm(device)
        bench.touch(0x0102)
        bench.touch(0x0100)  # gate 1 has moved, which matters less
        self.refused(wire.RefusalReason.WRONG_TOKEN, device.fire, token ^ 1)
        assert self.refused(wire.RefusalReason.GATE_BLOCKED, device.fire, token).detail == 0x0100

    def test_a_gate_that_moved_after_arming_forbids_fire(self, bench, device):
        token = arm(device)
        bench.touch(0x0802)
        bench.touch(0)
        assert self.refused(wire.RefusalReason.GATE_UNSTEADY, device.fire, token).detail == 0x0002
        device.abort()
        device.fire(arm(device))


class HoldSuite(Suite):
    def test_any_part_can_be_read_again(self, bench):
        line = Wire(bench)
        events, _ = line.drop()
        assert line.numbers == [*range(1, len(line.numbers) + 1)]
        assert len(line.numbers) < len(events) / 4, "events close together travel together"
        for seq, (first, count) in enumerate([(0, 1), (5, 3), (len(events) - 2, 40)], start=3):
            answer = line.ask(wire.Read(LABEL, first, count), seq)
            assert (answer.label, answer.first) == (LABEL, first)
            assert list(answer.snapshots) == events[first : first + count]
        many = line.ask(wire.Read(LABEL, 0, 255), 9)
        assert many.first == 0
        assert 0 < len(many.snapshots) <= wire.EVENTS_PER_FRAME
        assert list(many.snapshots) == events[: len(many.snapshots)]

    # -- resets

    def test_a_reset_disarms(self, bench, device):
        token = arm(device)
        self.restart(bench, device)
        assert device.status().phase is wire.Phase.IDLE
        self.refused(wire.RefusalReason.NOT_ARMED, device.fire, token)

    def test_a_held_drop_outlives_resets(self, bench, device):
        drop = record_drop(device)
        device.abort()
        self.restart(bench, device)
        self.restart(bench, device)
        again = self.reconnected(bench)
        state = again.status()
        assert (state.phase, state.label) == (wire.Phase.HOLDING, LABEL)
        assert state.events == drop.certificate.events
        self.refused(wire.RefusalReason.HOLDING_A_DROP, arm, again)  # that ABORT came is forgotten
        assert again.fetch(LABEL) == drop
        release_drop(again, drop)
        self.restart(bench, device)
        assert device.status().phase is wire.Phase.IDLE

    def test_a_reset_within_a_drop_is_seen_and_loses_it(self, bench, device):
        device.fire(arm(device, record_ms=2000))
        for _ in range(4):
            device.receive()
        bench.reset()
        said = r"restarted about \d+ ms after FIRE: is its supply shared with the magnets\?"
        refused(DeviceError, said, device.collect, LABEL)
        (drop,) = device.transcript.unfinished_drops()
        assert drop == device.transcript.pending(LABEL)
        assert "restarted" in {fault.code for fault in drop.faults}
        device.connect(boot_wait_s=0)
        self.refused(wire.RefusalReason.NO_SUCH_DROP, device.fetch, LABEL)
        assert device.status().phase is wire.Phase.IDLE
