"""The virtual board against the suite every device must pass, and what is its own."""

from itertools import pairwise

import serial
from hypothesis import given
from hypothesis import strategies as st

from rig.link.client import Device
from rig.link.messages import Phase
from rig.link.port import port_clock
from rig.link.refusals import DeviceRefusedError
from sim.board import POWER_ON, VirtualBoard
from sim.clock import VirtualClock
from sim.dials import Dials
from sim.serial_port import SimulatedSerial
from sim.snapshots import take_snapshots
from tests.link.bench import Bench, ScriptedLab
from tests.link.conformance import DeviceConformance
from tests.link.talk import record_drop
from tests.refusals import refused


def bench_of(lab: ScriptedLab, *, line=None, **board) -> Bench:
    return Bench(lab, VirtualBoard(lab, seed=1, ppm=2000, **board), **(line or {}))


class TestVirtualBoard(DeviceConformance):
    def make(self, lab):
        return bench_of(lab)

    def test_edges_are_exact(self, bench, device):
        drop = record_drop(device)
        hz = 16e6 * 1.002
        assert [e.tick for e in drop.edges] == [round(c[0] * hz) for c in bench.lab.changes]

    def test_a_drop_does_not_outlive_the_power(self, bench, device):
        record_drop(device)
        bench.board.reset(bench.clock().now_ns(), POWER_ON)
        device.connect()
        assert device.status().phase is Phase.IDLE

    def test_pulses_of_the_reference_during_a_restart_are_not_seen(self, bench, device):
        bench.reference([0.1, 0.2, 0.4])
        self.restart(bench, device)
        assert device.reference().count == 0
        bench.clock().sleep(0.15)
        assert device.reference().count == 1


class TestStreamingBoard(DeviceConformance):
    def make(self, lab):
        return bench_of(lab, streams=True, capacity=100)

    def test_a_line_too_slow_for_the_events_loses_some(self, bench, device):
        bench.lab.changes = [(0.01 + 20e-6 * n, 0, n % 2 == 0) for n in range(1000)]
        drop = record_drop(device)
        assert 0 < drop.certificate.overflows < 900
        assert drop.certificate.events + drop.certificate.overflows == 1000
        assert drop.faults[0].code == "edges_lost"


def test_a_board_of_another_version_is_refused_with_advice():
    board = VirtualBoard(ScriptedLab(), protocol_version=9)
    port = SimulatedSerial("test", board=board, timeout=0.02)
    error = refused(DeviceRefusedError, "protocol version 9", Device(port, port.clock).connect)
    assert "rig flash" in error.hint


def test_a_paced_clock_takes_real_time(monkeypatch):
    slept: list[float] = []
    monkeypatch.setattr("sim.clock.time.sleep", slept.append)
    clock = VirtualClock(pace=0.5)
    clock.sleep(2)
    clock.advance_to(1_000)
    assert slept == [1.0]
    assert clock.now_ns() == 2_000_000_000


@given(st.lists(st.tuples(st.floats(0, 0.01), st.integers(0, 3)), max_size=60).map(sorted))
def test_snapshots_account_for_every_change(toggles):
    """Each snapshot shows what its moment changed; a pulse that shows nothing has one too."""
    state, changes = 0, []
    for seconds, channel in toggles:
        state ^= 1 << channel
        changes.append((seconds, channel, bool(state >> channel & 1)))
    snapshots = take_snapshots(changes, 0xF, 16e6)
    assert (snapshots[-1].state if snapshots else 0) == state
    assert all(a.ticks < b.ticks for a, b in pairwise(snapshots))
    states = [0, *(snapshot.state for snapshot in snapshots)]
    edges = sum((a ^ b).bit_count() for a, b in pairwise(states))
    glitches = sum(a == b for a, b in pairwise(states))
    assert edges + 2 * glitches <= len(changes)
    assert bool(snapshots) == bool(changes)


def test_a_url_handler_only_says_which_board():
    class Serial(SimulatedSerial):
        def make_board(self):
            assert self.port == "sim://rig?seed=3"
            self.disturb(3, Dials.quiet())
            return VirtualBoard(ScriptedLab(), seed=3)

    port = Serial(None, baudrate=500_000, timeout=0.02, exclusive=True)
    port.port = "sim://rig?seed=3"
    port.open()
    assert Device(port, port_clock(port)).connect().unique_id == port.board.identity.unique_id
    port.close()
    refused(serial.PortNotOpenError, "", port.read, 1)
