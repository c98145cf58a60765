"""Every refusal, and which comes first where several would do."""

from __future__ import annotations

from rig.link import messages as wire
from rig.link.messages import Phase, RefusalReason, pack_label
from tests.link.bench import LABEL
from tests.link.suite import Suite
from tests.link.talk import Wire, arm

BAD = {"gates": 0}


class RefusalSuite(Suite):
    def test_a_blocked_gate_forbids_arming(self, bench, device):
        bench.lab.hanging = 0x0201
        error = self.refused(RefusalReason.GATE_BLOCKED, arm, device)
        assert error.detail == 0x0201
        assert "gates 0, 9 are blocked" in error.message

    def test_a_gate_blocked_after_arming_forbids_fire(self, bench, device):
        token = arm(device)
        bench.touch(0x0102)
        bench.touch(0x0100)  # gate 1 has moved, which matters less
        self.refused(RefusalReason.WRONG_TOKEN, device.fire, token ^ 1)
        assert self.refused(RefusalReason.GATE_BLOCKED, device.fire, token).detail == 0x0100

    def test_a_gate_that_moved_after_arming_forbids_fire(self, bench, device):
        token = arm(device)
        bench.touch(0x0802)
        bench.touch(0)
        assert self.refused(RefusalReason.GATE_UNSTEADY, device.fire, token).detail == 0x0002
        device.abort()
        device.fire(arm(device))

    def test_the_longest_pulse_is_the_one_it_names(self, device, identity):
        longest = identity.max_pulse_us
        self.refused(RefusalReason.BAD_PARAMETER, arm, device, pulse_us=longest + 1)
        arm(device, pulse_us=longest)

    def test_gates_and_releases_that_are_not_there(self, device, identity):
        if identity.gates < 16:
            self.refused(RefusalReason.BAD_PARAMETER, arm, device, gates=1 << identity.gates)
        if identity.releases < 8:
            self.refused(RefusalReason.BAD_PARAMETER, arm, device, release=1 << identity.releases)
        arm(device, gates=1 << identity.gates - 1, release=1 << identity.releases - 1)

    def test_arming_and_reading_while_recording(self, device):
        device.fire(arm(device))
        self.refused(RefusalReason.BUSY, arm, device, pack_label(8, 1), **BAD)
        self.refused(RefusalReason.BUSY, device.acknowledge, LABEL, 0)
        self.refused(RefusalReason.BUSY, device.fetch, LABEL)
        self.refused(RefusalReason.NOT_ARMED, device.fire, 5)
        assert device.collect(LABEL).faults == ()

    def test_a_held_drop_comes_before_what_is_wrong_with_a_request(self, device):
        self.drop(device)
        self.refused(RefusalReason.HOLDING_A_DROP, arm, device, **BAD)

    # -- what is no request

    def test_requests_far_too_long(self, bench):
        """Such a frame need not fit a device's memory: no answer is as good as a refusal."""
        line = Wire(bench)
        for seq, size in enumerate([16, 60, 248], start=1):
            line.send(0x04, bytes(size), seq)
            assert line.hear() in ([], [(seq, wire.Refused(RefusalReason.BAD_PARAMETER, 0))])
        assert line.ask(wire.Status(), 9).phase is Phase.IDLE
