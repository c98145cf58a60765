"""Holding a drop, reading it again, acknowledging it, and what a reset leaves."""

from rig.errors import DeviceError
from rig.link import messages as wire
from tests.link.bench import LABEL
from tests.link.suite import Suite
from tests.link.talk import Wire, arm, record_drop, release_drop
from tests.refusals import refused


class HoldSuite(Suite):
    def test_a_drop_is_held_across_reconnects_and_silence(self, bench, device):
        drop = record_drop(device)
        bench.reopen()
        bench.clock().sleep(0.4)
        again = self.reconnected(bench)
        assert again.status().label == LABEL
        assert again.fetch(LABEL) == drop
        release_drop(again, drop)

    def test_any_part_can_be_read_again(self, bench):
        line = Wire(bench)
        events, _ = line.drop()
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
