"""Who is there, and a whole drop from arming to acknowledging."""

import pytest

from rig.link.messages import Phase
from tests.link.bench import GATES, LABEL
from tests.link.suite import Suite
from tests.link.talk import Wire, arm


class DropSuite(Suite):
    def test_idle_state(self, bench, device):
        bench.touch(0x0201)
        state = device.status()
        assert (state.phase, state.label, state.events) == (Phase.IDLE, 0, 0)
        assert state.gates & GATES == 0x0201

    def test_a_drop_comes_whole_and_exact(self, bench, device, identity):
        drop = self.drop(device)
        self.check(bench, drop, identity)
        assert (drop.run, drop.attempt) == (7, 1)
        assert bench.lab.drops == [LABEL]
        self.release(device, drop)
        assert device.status().phase is Phase.IDLE

    def test_only_armed_gates_are_recorded(self, bench):
        events, certificate = Wire(bench).drop(gates=0x0002)
        assert len(events) == certificate.events == 20
        assert {event.state for event in events} == {0, 2}
        assert certificate.glitches == 0

    def test_a_blocked_gate_that_is_not_armed_does_not_matter(self, bench, device, identity):
        bench.lab.hanging = 0x0800
        self.check(bench, self.drop(device), identity)

    def test_the_32_bit_time_may_wrap_within_a_drop(self, bench, device, identity):
        if not bench.can_preset_tick:
            pytest.skip("the counter cannot be preset here")
        bench.preset_tick(seconds_before_wrap=0.05)
        arm(device)
        device.fire(arm(device))  # arming again while armed is allowed
        drop = device.collect(LABEL)
        assert drop.fire_tick > 2**32 - 0.06 * identity.tick_hz
        self.check(bench, drop, identity)
