"""A bad line: repeats, losses, damage, junk, silence; and the replay of what was heard over it."""

import pytest

from rig.link import messages as wire
from rig.link.client import Device
from rig.link.transcript import Transcript
from rig.records import ClockSample, Drop, Edge
from tests.link.bench import LABEL
from tests.link.suite import Suite
from tests.link.talk import LossyPort, NoisyPort, Wire, arm, order, record_drop, release_drop


class LineSuite(Suite):
    def test_the_same_seq_with_another_request_is_no_repeat(self, bench):
        line = Wire(bench)
        assert isinstance(line.ask(wire.Status(), 1), wire.State)
        assert isinstance(line.ask(wire.Ping(), 1), wire.Pong)
        armed = line.ask(order(), 1)
        assert line.ask(wire.Status(), 2).phase is wire.Phase.ARMED
        assert line.ask(order(), 1) != armed

    def test_lost_events_and_certificate_are_read_again(self, bench):
        port = LossyPort(bench)
        device = Device(port, bench.clock())
        device.connect()
        device.fire(arm(device))
        port.lose_rx_until_ns = bench.clock().now_ns() + 200_000_000
        self.check(bench, device.collect(LABEL), device.transcript.identity)

    @pytest.mark.parametrize("seed", range(3))
    def test_one_percent_of_damaged_bytes_changes_nothing(self, bench, seed):
        port = NoisyPort(bench.port(), 0.01, seed)
        device = Device(port, bench.clock(), tries=40)
        device.connect()
        for run in range(3):
            drop = record_drop(device, wire.pack_label(run, 1))
            self.check(bench, drop, device.transcript.identity)
            release_drop(device, drop)
        assert device.transcript.rx.bad > 0
        assert bench.lab.drops == [wire.pack_label(run, 1) for run in range(3)]

    def test_the_recorded_bytes_give_the_same_records(self, bench):
        chunks, live = [], []
        port = NoisyPort(bench.port(), 0.003)
        device = Device(
            port,
            bench.clock(),
            lambda *chunk: chunks.append(chunk),
            on_record=live.append,
            tries=40,
        )
        device.connect()
        device.ping()
        pending = record_drop(device)
        release_drop(device, pending)
        offline = Transcript()
        records = [record for chunk in chunks for record in offline.feed(*chunk)]
        assert records == live
        assert [r for r in records if isinstance(r, Drop)] == [pending]
        assert any(isinstance(r, ClockSample) for r in records)
        assert isinstance(pending.edges[0], Edge)
        assert offline.unfinished_drops() == []
