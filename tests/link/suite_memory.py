"""What happens to many events, to events close together, and to pulses too short to be seen."""

from itertools import pairwise

import pytest

from rig.link import messages as wire
from rig.link.client import Device
from rig.link.transcript import Transcript
from rig.reasons import make_reason
from tests.link.bench import LABEL
from tests.link.suite import Suite
from tests.link.talk import LossyPort, Wire, arm, record_drop, release_drop

_SPACING_S = 3e-4


def blinking(count: int) -> list[tuple[float, int, bool]]:
    return [(0.01 + _SPACING_S * n, 0, n % 2 == 0) for n in range(count)]


def record_ms(count: int) -> int:
    return round(1000 * _SPACING_S * count) + 40


class MemorySuite(Suite):
    @pytest.fixture
    def more(self, bench, identity) -> int:
        """Have a device that streams see 60 events more than it keeps; give their number."""
        if not identity.streams:
            pytest.skip("a device that keeps a drop whole")
        bench.lab.changes = blinking(identity.capacity + 60)
        return identity.capacity + 60

    def test_a_full_memory_is_counted(self, bench, device, identity):
        if identity.streams:
            pytest.skip("a device that streams does not keep a drop whole")
        count = identity.capacity + 20
        bench.lab.changes = blinking(count)
        drop = record_drop(device, record_ms=record_ms(count))
        assert len(drop.edges) == drop.certificate.events == identity.capacity
        assert drop.certificate.overflows == 20
        assert drop.faults == (make_reason("edges_lost", lost=20),)

    def test_a_streamed_drop_may_be_longer_than_the_memory(self, bench, device, identity, more):
        drop = record_drop(device, record_ms=record_ms(more))
        self.check(bench, drop, identity)
        late = self.reconnected(bench).fetch(LABEL)
        assert late.edges == drop.edges[-len(late.edges) :]
        assert "events_overwritten" in {fault.code for fault in late.faults}

    def test_a_streaming_device_reads_out_what_it_keeps(self, bench, more):
        line = Wire(bench)
        events, certificate = line.drop(record_ms=record_ms(more))
        assert len(events) == certificate.events == more
        for seq, first in enumerate([0, 59], start=1):
            assert line.ask(wire.Read(LABEL, first, 1), seq) == wire.Refused(
                wire.RefusalReason.NOT_KEPT, 60
            )
        for seq, first in enumerate([60, more - 1], start=3):
            assert line.ask(wire.Read(LABEL, first, 1), seq).snapshots == (events[first],)
        assert line.ask(wire.Read(LABEL, 0, 0), 5) == certificate
        assert line.ask(wire.Acknowledge(LABEL, certificate.crc32), 6) == wire.Done()

    def test_events_that_nobody_has_any_more_are_a_fault(self, bench, identity, more):
        port, chunks, offline = LossyPort(bench), [], Transcript()
        device = Device(port, bench.clock(), lambda *chunk: chunks.append(chunk))
        device.connect(boot_wait_s=0)
        device.fire(arm(device, record_ms=record_ms(more)))
        port.lose_rx_until_ns = bench.clock().now_ns() + (record_ms(more) + 20) * 1_000_000
        drop = device.collect(LABEL)
        overwritten = make_reason("events_overwritten", missing=60, events=more, first=0)
        assert drop.faults == (overwritten,)
        assert len(drop.edges) == identity.capacity - 1  # behind the gap one change is in doubt
        for chunk in chunks:
            offline.feed(*chunk)
        assert offline.unfinished_drops() == [drop], "the replay knows it, too"
        release_drop(device, drop)

    def test_a_short_pulse_is_an_event_and_no_edge(self, bench):
        """Its second edge may find the interrupt free again, and give a second event."""
        bench.lab.changes = [(0.01, 0, True), (0.01 + 0.2e-6, 0, False), (0.02, 1, True)]
        line = Wire(bench)
        events, certificate = line.drop()
        states = [0, *(event.state for event in events)]
        assert certificate.glitches == sum(a == b for a, b in pairwise(states))
        assert certificate.glitches in {1, 2}
        assert states[-1] == 0x0002
        device = self.reconnected(bench)
        drop = device.fetch(LABEL)
        assert [(edge.channel, edge.blocked) for edge in drop.edges] == [(1, True)]
        assert drop.faults == ()  # nothing that the drop needs is missing
        assert drop.certificate.glitches == certificate.glitches

    @pytest.mark.parametrize("gates", [(0, 8), (8, 0), (1, 9), (0, 1), (8, 9), (0, 1, 8, 9)])
    def test_gates_that_change_at_one_moment_are_no_pulse(self, bench, gates):
        """Each port wakes the interrupt, and all have been read by the first of them."""
        bench.lab.changes = [(at, one, at < 0.015) for at in (0.01, 0.02) for one in gates]
        events, certificate = Wire(bench).drop()
        assert [event.state for event in events][-1:] == [0]
        assert certificate.glitches == 0
        assert len({event.state for event in events}) == len(events)

    def test_stamps_close_behind_another_are_counted_as_late(self, bench, identity):
        near = 0.75 * identity.late_ticks / identity.tick_hz
        bench.lab.changes = [
            *((0.01, 0, True), (0.01 + near, 8, True)),
            *((0.02, 0, False), (0.02 + 3 * near, 8, False)),
        ]
        events, certificate = Wire(bench).drop()
        gaps = [(b.tick - a.tick) % 2**32 for a, b in pairwise(events)]
        assert len(gaps) == 3
        assert certificate.late == sum(gap < identity.late_ticks for gap in gaps) == 1
