"""One suite for every device that speaks the wire: inherit `DeviceConformance`, give it a bench.

The bench is the device with hands around it: something that blocks and frees its gates. What a
bench cannot do (preset the counter, say) it says, and those tests are skipped.
"""

from __future__ import annotations

import random
import zlib
from abc import ABC, abstractmethod
from dataclasses import dataclass, field

import pytest

from rig.errors import DeviceError, DeviceTimeoutError
from rig.link import messages as wire
from rig.link.client import Device
from rig.link.clock import tick_rate
from rig.link.frames import Decoder, Frame, encode
from rig.link.messages import Phase, Reason, pack_label
from rig.link.refusals import DeviceRefusedError
from rig.link.transcript import Received, Transcript
from rig.records import Drop, Edge, Ping

GATES = 0x0303
LABEL = pack_label(7, 1)


@dataclass
class ScriptedLab:
    """A lab whose drops are written down beforehand."""

    hanging: int = 0
    changes: list[tuple[float, int, bool]] = field(default_factory=list)
    drops: list[int] = field(default_factory=list)

    def rest(self, label: int) -> int:
        return self.hanging

    def drop(self, label: int) -> list[tuple[float, int, bool]]:
        self.drops.append(label)
        return self.changes


class Bench(ABC):
    """A device under test. `lab` is what its gates will see at the next ARM and FIRE."""

    tick_tolerance = 1
    can_preset_tick = False

    def __init__(self, lab: ScriptedLab) -> None:
        self.lab = lab

    @abstractmethod
    def port(self): ...

    @abstractmethod
    def clock(self): ...

    @abstractmethod
    def touch(self, gates: int) -> None:
        """Block exactly these gates now."""

    @abstractmethod
    def reset(self) -> None: ...

    @abstractmethod
    def reopen(self) -> None:
        """Close the port and open it again, without a reset."""

    def preset_tick(self, seconds_before_wrap: float) -> None:
        raise NotImplementedError


class NoisyPort:
    """Damages what passes a port, so that no device has to do it by itself."""

    def __init__(self, port, rate: float, seed: int = 1) -> None:
        self.port, self.rate, self.random = port, rate, random.Random(seed)

    def damage(self, data: bytes) -> bytes:
        return bytes(
            b ^ self.random.randrange(1, 256) if self.random.random() < self.rate else b
            for b in data
        )

    @property
    def in_waiting(self) -> int:
        return self.port.in_waiting

    def read(self, size: int = 1) -> bytes:
        return self.damage(self.port.read(size))

    def write(self, data: bytes) -> int:
        return self.port.write(self.damage(data))


class LossyPort(NoisyPort):
    """Loses the next `lose_tx` writes, and what is read before `lose_rx_until_ns`."""

    def __init__(self, bench: Bench) -> None:
        super().__init__(bench.port(), 0)
        self.clock = bench.clock()
        self.lose_tx = 0
        self.lose_rx_until_ns = 0

    def write(self, data: bytes) -> int:
        if self.lose_tx:
            self.lose_tx -= 1
            return len(data)
        return self.port.write(data)

    def read(self, size: int = 1) -> bytes:
        data = self.port.read(size)
        return b"" if self.clock.now_ns() < self.lose_rx_until_ns else data


class Wire:
    """Speaks in single frames, with any seq."""

    def __init__(self, bench: Bench) -> None:
        self.bench, self.decoder = bench, Decoder()
        bench.port().write(b"\0")

    def say(self, message: wire.Message, seq: int) -> None:
        code, payload = wire.pack(message)
        self.bench.port().write(encode(Frame(code, seq, 0, payload)))

    def hear(self, seconds: float = 0.1) -> list[tuple[int, wire.Message]]:
        clock, port = self.bench.clock(), self.bench.port()
        until, heard = clock.now_ns() + seconds * 1e9, []
        while clock.now_ns() < until:
            frames = self.decoder.feed(port.read(max(1, port.in_waiting)))
            heard += [(frame.ack, wire.unpack(frame.type, frame.payload)) for frame in frames]
        return heard

    def ask(self, message: wire.Message, seq: int) -> wire.Message:
        self.say(message, seq)
        answers = [m for ack, m in self.hear() if ack == seq]
        assert len(answers) == 1
        return answers[0]


def falling_rods(rods: int = 10, start_s: float = 0.05) -> list[tuple[float, int, bool]]:
    """Write changes like those of two chains through two gates each."""
    changes = []
    for channel, shift in ((0, 0.0), (1, 0.004), (8, 0.0007), (9, 0.0051)):
        for rod in range(rods):
            at = start_s + shift + 0.02 * rod - 0.0004 * rod**1.5
            changes += [(at, channel, True), (at + 0.003, channel, False)]
    return sorted(changes)


def arm(device: Device, label: int = LABEL, **changes: int) -> int:
    order = {"gates": GATES, "release": 1, "pulse_us": 80_000, "timeout_ms": 5000, "record_ms": 400}
    return device.arm(label=label, **(order | changes))


def order(**changes: int) -> wire.Arm:
    values = {"label": LABEL, "gates": GATES, "release": 1, "pulse_us": 80_000}
    return wire.Arm(**(values | {"timeout_ms": 5000, "record_ms": 400} | changes))


class DeviceConformance:
    """What every device must do."""

    def make(self, lab: ScriptedLab) -> Bench:
        raise NotImplementedError

    @pytest.fixture
    def bench(self) -> Bench:
        return self.make(ScriptedLab(changes=falling_rods()))

    @pytest.fixture
    def device(self, bench) -> Device:
        device = Device(bench.port(), bench.clock())
        device.connect()
        return device

    def check(self, bench: Bench, drop: Drop, identity: wire.Identity, faults=()) -> None:
        """Compare a drop's edges with what the lab did."""
        assert drop.faults == faults
        done = [c for c in bench.lab.changes if GATES >> c[1] & 1]
        assert [(e.channel, e.blocked) for e in drop.edges] == [(c[1], c[2]) for c in done]
        # Within a drop even a resonator 0.5 % off must fit; the virtual board is exact.
        for edge, (seconds, _, _) in zip(drop.edges, done, strict=True):
            ticks = seconds * identity.tick_hz
            assert abs(edge.tick - ticks) <= bench.tick_tolerance + 0.005 * ticks

    def drop(self, device: Device, label: int = LABEL, **changes: int) -> Drop:
        device.fire(arm(device, label, **changes))
        return device.collect(label)

    # -- who is there

    def test_says_who_it_is(self, device):
        identity = device.transcript.identity
        assert identity.protocol_version == wire.PROTOCOL_VERSION
        assert identity.tick_hz > 1_000_000
        assert identity.capacity >= 128
        assert len(identity.channels.split()) == identity.gates
        assert any(identity.unique_id)

    def test_a_client_of_another_version_is_refused(self, bench):
        line = Wire(bench)
        line.hear(2.0)
        answer = line.ask(wire.Identify(wire.PROTOCOL_VERSION + 1), 1)
        assert answer == wire.Refused(Reason.VERSION, wire.PROTOCOL_VERSION)

    def test_a_reset_is_announced(self, bench, device):
        bench.reset()
        with pytest.raises(DeviceError, match="restarted"):
            device.collect(LABEL, timeout=3.0)
        assert device.connect(boot_wait_s=0.1) == device.transcript.identity

    def test_idle_state(self, device):
        state = device.status()
        assert (state.phase, state.label, state.events) == (Phase.IDLE, 0, 0)

    def test_pings_give_the_rate(self, bench, device):
        pings = []
        for _ in range(60):
            pings.append(device.ping())
            bench.clock().sleep(0.1)
        rate = tick_rate(pings, device.transcript.identity.tick_hz)
        assert abs(rate.hz / device.transcript.identity.tick_hz - 1) < 0.006

    # -- a whole drop

    def test_a_drop_comes_whole_and_exact(self, bench, device):
        drop = self.drop(device)
        self.check(bench, drop, device.transcript.identity)
        assert (drop.run, drop.attempt) == (7, 1)
        assert bench.lab.drops == [LABEL]
        device.acknowledge(LABEL, drop.certificate.crc32)
        assert device.status().phase is Phase.IDLE

    def test_phases_in_order(self, device):
        token = arm(device)
        assert device.status().phase is Phase.ARMED
        device.fire(token)
        state = device.status()
        assert (state.phase, state.label) == (Phase.RECORDING, LABEL)
        drop = device.collect(LABEL)
        state = device.status()
        assert (state.phase, state.label) == (Phase.HOLDING, LABEL)
        assert state.events == drop.certificate.events

    def test_only_armed_gates_are_recorded(self, bench, device):
        drop = self.drop(device, gates=0x0002)
        assert {e.channel for e in drop.edges} == {1}
        assert drop.faults == ()

    def test_a_blocked_gate_that_is_not_armed_does_not_matter(self, bench, device):
        bench.lab.hanging = 0x8000
        self.check(bench, self.drop(device), device.transcript.identity)

    def test_a_drop_without_edges(self, bench, device):
        bench.lab.changes = []
        drop = self.drop(device)
        assert drop.edges == ()
        assert drop.faults == ()
        assert drop.certificate.crc32 == zlib.crc32(b"")

    def test_two_drops(self, bench, device):
        for run in (1, 2):
            label = pack_label(run, 1)
            drop = self.drop(device, label)
            self.check(bench, drop, device.transcript.identity)
            device.acknowledge(label, drop.certificate.crc32)

    def test_the_certificate_is_over_the_wire_s_own_bytes(self, bench):
        line = Wire(bench)
        line.hear(2.0)
        token = line.ask(order(), 1).token
        line.say(wire.Fire(token), 2)
        heard = [message for _, message in line.hear(1.0)]
        packed = b"".join(wire.pack(m)[1][6:] for m in heard if isinstance(m, wire.EventsFrame))
        assert isinstance(heard[-1], wire.DropCertificate)
        assert heard[-1].crc32 == zlib.crc32(packed)
        assert heard[-1].events * 6 == len(packed)
        assert heard[0] == wire.Fired(heard[-1].fire_tick)

    def test_the_32_bit_time_may_wrap_within_a_drop(self, bench, device):
        if not bench.can_preset_tick:
            pytest.skip("the counter cannot be preset here")
        arm(device)
        token = arm(device)  # arming again while armed is allowed
        bench.preset_tick(seconds_before_wrap=0.15)
        device.fire(token)
        drop = device.collect(LABEL)
        assert drop.fire_tick > 0xF0000000
        self.check(bench, drop, device.transcript.identity)

    def test_a_full_memory_is_counted(self, bench, device):
        capacity = device.transcript.identity.capacity
        bench.lab.changes = [(0.01 + 3e-4 * n, 0, n % 2 == 0) for n in range(capacity + 20)]
        drop = self.drop(device, record_ms=900)
        assert len(drop.edges) == drop.certificate.events == capacity
        assert drop.certificate.overflows == 20
        assert drop.faults == ("20 events lost: the device's memory was full",)

    def test_a_short_pulse_is_counted_as_glitch(self, bench, device):
        bench.lab.changes = [(0.01, 0, True), (0.01 + 1e-6, 0, False), (0.02, 1, True)]
        drop = self.drop(device)
        assert drop.certificate.glitches == 1
        assert [e.channel for e in drop.edges] == [1]

    # -- holding, reading again, acknowledging

    def test_a_drop_is_held_across_reconnects(self, bench, device):
        drop = self.drop(device)
        bench.reopen()
        again = Device(bench.port(), bench.clock())
        again.connect(boot_wait_s=0)
        assert again.status().label == LABEL
        assert again.fetch(LABEL) == drop
        again.acknowledge(LABEL, drop.certificate.crc32)

    def test_any_part_can_be_read_again(self, bench):
        line = Wire(bench)
        line.hear(2.0)
        line.say(wire.Fire(line.ask(order(), 1).token), 2)
        heard = [message for _, message in line.hear(1.0)]
        events = [e for m in heard if isinstance(m, wire.EventsFrame) for e in m.events]
        for seq, (first, count) in enumerate([(0, 1), (5, 3), (len(events) - 2, 40)], start=3):
            answer = line.ask(wire.Read(LABEL, first, count), seq)
            assert answer.first == first
            assert list(answer.events) == events[first : first + count]
        assert line.ask(wire.Read(LABEL, 0, 0), 10) == heard[-1]
        answer = line.ask(wire.Read(LABEL, len(events), 1), 11)
        assert answer.reason is Reason.BAD_PARAMETER
        assert line.ask(wire.Read(LABEL + 1, 0, 1), 12).reason is Reason.NO_SUCH_DROP

    def test_only_the_right_crc_releases_a_drop(self, device):
        drop = self.drop(device)
        self.refused(Reason.WRONG_CRC, device.acknowledge, LABEL, drop.certificate.crc32 ^ 1)
        assert device.status().phase is Phase.HOLDING
        device.acknowledge(LABEL, drop.certificate.crc32)
        self.refused(Reason.NO_SUCH_DROP, device.acknowledge, LABEL, drop.certificate.crc32)

    def test_a_held_drop_forbids_arming(self, device):
        self.drop(device)
        error = self.refused(Reason.HOLDING_A_DROP, arm, device, pack_label(8, 1))
        assert "run 7" in error.message
        self.refused(Reason.HOLDING_A_DROP, arm, device, LABEL)

    def test_after_abort_the_same_label_may_be_armed_again(self, device):
        self.drop(device)
        device.abort()
        self.refused(Reason.HOLDING_A_DROP, arm, device, pack_label(8, 1))
        drop = self.drop(device)
        assert drop.faults == ()

    def test_abort_ends_a_recording_and_keeps_it(self, bench, device):
        device.fire(arm(device, record_ms=20_000))
        start = bench.clock().now_ns()
        drop = device.collect(LABEL, stop=lambda: bench.clock().now_ns() > start + 150_000_000)
        assert bench.clock().now_ns() < start + 1_000_000_000
        assert drop.faults == ()
        assert 0 < len(drop.edges) < len(bench.lab.changes)

    # -- refusals

    def refused(self, reason: Reason, call, *args, **kwargs) -> DeviceRefusedError:
        with pytest.raises(DeviceRefusedError) as caught:
            call(*args, **kwargs)
        assert caught.value.reason is reason
        assert caught.value.hint
        return caught.value

    def test_fire_needs_arm(self, device):
        self.refused(Reason.NOT_ARMED, device.fire, 1)

    def test_fire_needs_the_right_token(self, bench, device):
        token = arm(device)
        self.refused(Reason.WRONG_TOKEN, device.fire, token ^ 1)
        assert bench.lab.drops == []
        device.fire(token)

    def test_a_blocked_gate_forbids_arming(self, bench, device):
        bench.lab.hanging = 0x0201
        error = self.refused(Reason.GATE_BLOCKED, arm, device)
        assert error.detail == 0x0201
        assert "gates 0, 9 are blocked" in error.message

    def test_a_gate_blocked_after_arming_forbids_fire(self, bench, device):
        token = arm(device)
        bench.touch(0x0100)
        assert self.refused(Reason.GATE_BLOCKED, device.fire, token).detail == 0x0100

    def test_a_gate_that_moved_after_arming_forbids_fire(self, bench, device):
        token = arm(device)
        bench.touch(0x8002)
        bench.touch(0)
        assert self.refused(Reason.GATE_UNSTEADY, device.fire, token).detail == 0x0002
        device.abort()
        device.fire(arm(device))

    @pytest.mark.parametrize(
        "bad",
        [
            {"label": 0},
            {"gates": 0},
            {"release": 0x80},
            {"release": 0},
            {"pulse_us": 0},
            {"pulse_us": 2**32 - 1},
            {"timeout_ms": 0},
            {"record_ms": 0},
        ],
    )
    def test_bad_parameters(self, device, bad):
        self.refused(Reason.BAD_PARAMETER, arm, device, **bad)
        assert device.status().phase is Phase.IDLE

    def test_a_drop_without_release_is_possible(self, bench, device):
        self.check(bench, self.drop(device, release=0, pulse_us=0), device.transcript.identity)

    def test_arming_and_reading_while_recording(self, device):
        device.fire(arm(device))
        self.refused(Reason.BUSY, arm, device, pack_label(8, 1))
        self.refused(Reason.BUSY, device.acknowledge, LABEL, 0)
        self.refused(Reason.NOT_ARMED, device.fire, 5)
        assert device.collect(LABEL).faults == ()

    def test_unknown_messages_and_wrong_payloads(self, bench):
        line = Wire(bench)
        line.hear(2.0)
        for seq, (code, payload, answer) in enumerate(
            [
                (0x55, b"", wire.Refused(Reason.UNKNOWN_MESSAGE, 0x55)),
                (0x82, bytes(4), wire.Refused(Reason.UNKNOWN_MESSAGE, 0x82)),
                (0x05, b"\1\2\3", wire.Refused(Reason.BAD_PARAMETER, 0)),
                (0x02, b"\1", wire.Refused(Reason.BAD_PARAMETER, 0)),
                (0x04, bytes(248), wire.Refused(Reason.BAD_PARAMETER, 0)),
            ],
            start=1,
        ):
            bench.port().write(encode(Frame(code, seq, 0, payload)))
            assert line.hear() == [(seq, answer)]

    def test_arming_times_out(self, bench, device):
        token = arm(device, timeout_ms=300)
        bench.clock().sleep(0.5)
        messages = [r.message for _ in range(20) for r in device.poll() if isinstance(r, Received)]
        assert messages == [wire.Disarmed(LABEL, wire.DisarmReason.TIMEOUT)]
        self.refused(Reason.NOT_ARMED, device.fire, token)

    def test_abort_disarms(self, device):
        token = arm(device)
        device.abort()
        assert device.status().phase is Phase.IDLE
        self.refused(Reason.NOT_ARMED, device.fire, token)

    # -- a bad line

    def test_a_repeated_request_is_answered_and_not_executed_again(self, bench):
        line = Wire(bench)
        line.hear(2.0)
        armed = line.ask(order(), 1)
        assert line.ask(order(), 1) == armed
        line.say(wire.Fire(armed.token), 2)
        line.say(wire.Fire(armed.token), 2)
        heard = line.hear(1.0)
        fired = [m for ack, m in heard if ack == 2]
        assert len(fired) == 2
        assert isinstance(fired[0], wire.Fired)
        assert fired[0] == fired[1]
        assert bench.lab.drops == [LABEL]
        assert sum(isinstance(m, wire.DropCertificate) for _, m in heard) == 1
        crc32 = next(m.crc32 for _, m in heard if isinstance(m, wire.DropCertificate))
        assert line.ask(wire.Acknowledge(LABEL, crc32), 3) == wire.Done()
        assert line.ask(wire.Acknowledge(LABEL, crc32), 3) == wire.Done()

    def test_a_lost_request_is_sent_again(self, bench):
        port = LossyPort(bench)
        device = Device(port, bench.clock())
        device.connect()
        port.lose_tx = 2
        token = arm(device)
        port.lose_tx = 2
        device.fire(token)
        self.check(bench, device.collect(LABEL), device.transcript.identity)
        assert bench.lab.drops == [LABEL]

    def test_a_lost_answer_to_fire_does_not_fire_again(self, bench):
        port = LossyPort(bench)
        device = Device(port, bench.clock())
        device.connect()
        token = arm(device)
        port.lose_rx_until_ns = bench.clock().now_ns() + 80_000_000
        device.fire(token)
        assert bench.lab.drops == [LABEL]
        self.check(bench, device.collect(LABEL), device.transcript.identity)

    def test_lost_events_and_certificate_are_read_again(self, bench):
        port = LossyPort(bench)
        device = Device(port, bench.clock())
        device.connect()
        device.fire(arm(device))
        port.lose_rx_until_ns = bench.clock().now_ns() + 500_000_000
        self.check(bench, device.collect(LABEL), device.transcript.identity)

    def test_repeated_pings_give_no_sample(self, bench):
        port = LossyPort(bench)
        device = Device(port, bench.clock())
        device.connect()
        port.lose_tx = 1
        assert device.ping() is None
        assert device.ping() is not None

    def test_junk_on_the_line(self, bench, device):
        noise = random.Random(3)
        for _ in range(20):
            bench.port().write(noise.randbytes(noise.randrange(1, 600)))
            bench.port().write(b"\0")
            assert device.status().phase is Phase.IDLE

    @pytest.mark.parametrize("seed", range(3))
    def test_one_percent_of_damaged_bytes_changes_nothing(self, bench, seed):
        port = NoisyPort(bench.port(), 0.01, seed)
        device = Device(port, bench.clock(), tries=40)
        device.connect()
        for run in range(3):
            label = pack_label(run, 1)
            drop = self.drop(device, label)
            self.check(bench, drop, device.transcript.identity)
            device.acknowledge(label, drop.certificate.crc32)
        assert device.transcript.bad_frames > 0
        assert bench.lab.drops == [pack_label(run, 1) for run in range(3)]

    def test_a_reset_within_a_drop_is_seen(self, bench, device):
        device.fire(arm(device, record_ms=2000))
        for _ in range(8):
            device.poll()
        bench.reset()
        with pytest.raises(DeviceError, match="restarted"):
            device.collect(LABEL)
        (drop,) = device.transcript.unfinished()
        assert drop == device.transcript.pending(LABEL)
        assert any("restarted" in fault for fault in drop.faults)
        device.connect()
        self.refused(Reason.NO_SUCH_DROP, device.fetch, LABEL)
        assert device.status().phase is Phase.IDLE

    def test_a_silent_device_is_a_time_out(self, bench):
        port = LossyPort(bench)
        port.lose_tx = 1000
        with pytest.raises(DeviceTimeoutError) as caught:
            Device(port, bench.clock()).connect()
        assert "cable" in caught.value.hint

    # -- replay

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
        pending = self.drop(device)
        device.acknowledge(LABEL, pending.certificate.crc32)
        offline = Transcript()
        records = [record for chunk in chunks for record in offline.feed(*chunk)]
        assert records == live
        assert [r for r in records if isinstance(r, Drop)] == [pending]
        assert any(isinstance(r, Ping) for r in records)
        assert isinstance(pending.edges[0], Edge)
        assert offline.unfinished() == []
