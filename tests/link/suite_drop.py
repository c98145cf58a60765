"""Who is there, and a whole drop from arming to acknowledging."""

import zlib

import pytest

from rig.link import messages as wire
from rig.link.messages import Phase
from tests.link.bench import GATES, LABEL
from tests.link.suite import Suite
from tests.link.talk import Wire, arm


class DropSuite(Suite):
    def test_says_who_it_is(self, identity):
        assert identity.protocol_version == wire.PROTOCOL_VERSION
        assert identity.board
        assert identity.firmware
        assert identity.tick_hz > 1_000_000
        assert identity.capacity >= 100
        assert identity.streams in {0, 1}
        assert identity.late_ticks > 0
        assert identity.releases >= 1
        assert identity.max_pulse_us >= 80_000
        assert identity.gates >= GATES.bit_length()
        assert len(identity.channels.split()) == identity.gates
        assert any(identity.unique_id)

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

    def test_a_drop_without_edges(self, bench, device):
        bench.lab.changes = []
        drop = self.drop(device)
        assert drop.edges == ()
        assert drop.faults == ()
        assert drop.certificate.crc32 == zlib.crc32(b"")

    def test_the_32_bit_time_may_wrap_within_a_drop(self, bench, device, identity):
        if not bench.can_preset_tick:
            pytest.skip("the counter cannot be preset here")
        bench.preset_tick(seconds_before_wrap=0.05)
        arm(device)
        device.fire(arm(device))  # arming again while armed is allowed
        drop = device.collect(LABEL)
        assert drop.fire_tick > 2**32 - 0.06 * identity.tick_hz
        self.check(bench, drop, identity)
