"""Who is there, and a whole drop from arming to acknowledging."""

from __future__ import annotations

import zlib

import pytest

from rig.clock.rate import tick_rate
from rig.link import messages as wire
from rig.link.messages import Phase, RefusalReason, pack_label
from tests.link.bench import GATES, LABEL
from tests.link.suite import Suite
from tests.link.talk import Wire, arm, order


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

    @pytest.mark.parametrize("version", [0, wire.PROTOCOL_VERSION + 1])
    def test_a_client_of_another_version_is_refused(self, bench, version):
        answer = Wire(bench).ask(wire.Identify(version), 1)
        assert answer == wire.Refused(RefusalReason.VERSION, wire.PROTOCOL_VERSION)

    def test_idle_state(self, bench, device):
        bench.touch(0x0201)
        state = device.status()
        assert (state.phase, state.label, state.events) == (Phase.IDLE, 0, 0)
        assert state.gates & GATES == 0x0201

    def test_pings_give_the_rate(self, bench, device, identity):
        pings = []
        for _ in range(25):
            pings.append(device.ping())
            bench.clock().sleep(0.1)
        rate = tick_rate(pings, identity.tick_hz)
        assert rate.n
        assert abs(rate.hz / identity.tick_hz - 1) < 0.006

    def test_a_drop_comes_whole_and_exact(self, bench, device, identity):
        drop = self.drop(device)
        self.check(bench, drop, identity)
        assert (drop.run, drop.attempt) == (7, 1)
        assert bench.lab.drops == [LABEL]
        self.release(device, drop)
        assert device.status().phase is Phase.IDLE

    def test_phases_in_order(self, device):
        token = arm(device)
        state = device.status()
        assert (state.phase, state.label, state.events) == (Phase.ARMED, LABEL, 0)
        device.fire(token)
        state = device.status()
        assert (state.phase, state.label) == (Phase.RECORDING, LABEL)
        drop = device.collect(LABEL)
        state = device.status()
        assert (state.phase, state.label) == (Phase.HOLDING, LABEL)
        assert state.events == drop.certificate.events

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

    def test_two_drops(self, bench, device, identity):
        for run in (1, 2):
            drop = self.drop(device, pack_label(run, 1))
            self.check(bench, drop, identity)
            self.release(device, drop)

    def test_a_drop_without_release_is_possible(self, bench, device, identity):
        self.check(bench, self.drop(device, release=0, pulse_us=0), identity)

    def test_the_certificate_is_over_the_wire_s_own_bytes(self, bench):
        line = Wire(bench)
        token = line.ask(order(), 1).token
        line.say(wire.Fire(token), 2)
        heard = [message for _, message in line.hear_drop()]
        packed = b"".join(wire.pack(m)[1][6:] for m in heard if isinstance(m, wire.EventsFrame))
        end = heard[-1]
        assert isinstance(end, wire.DropCertificate)
        assert end.crc32 == zlib.crc32(packed)
        assert end.events * 6 == len(packed)
        assert heard[0] == wire.Fired(end.fire_tick)
        assert (end.label, end.gates, end.initial_state) == (LABEL, GATES, 0)
        assert (end.overflows, end.glitches) == (0, 0)

    def test_the_32_bit_time_may_wrap_within_a_drop(self, bench, device, identity):
        if not bench.can_preset_tick:
            pytest.skip("the counter cannot be preset here")
        bench.preset_tick(seconds_before_wrap=0.05)
        arm(device)
        device.fire(arm(device))  # arming again while armed is allowed
        drop = device.collect(LABEL)
        assert drop.fire_tick > 2**32 - 0.06 * identity.tick_hz
        self.check(bench, drop, identity)
