"""Every refusal, and which comes first where several would do."""

from rig.link.messages import RefusalReason
from tests.link.suite import Suite
from tests.link.talk import arm


class RefusalSuite(Suite):
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

    # -- what is no request
