"""Ways to speak to a device under test: good requests, single frames, bad lines."""

import random
from pathlib import Path
from urllib.parse import quote

import serial

from rig.link import messages as wire
from rig.link.client import BOOT_WAIT_S, Device
from rig.link.frames import Decoder, Frame, encode
from rig.link.port import open_port, port_clock
from rig.records import Drop
from tests.link.bench import GATES, LABEL, Bench

FENCE = Path(__file__).parents[2] / "protocols/picket-fence.yaml"
IDENTITY = wire.Identity(
    2, "mega2560", "1.0", bytes(8), 16_000_000, 16, 2, 500_000, 1024, 0, 256, ""
)
ORDER = {"gates": GATES, "release": 1, "pulse_us": 20_000, "timeout_ms": 5000, "record_ms": 150}


def arm(device: Device, label: int = LABEL, **changes: int) -> int:
    return device.arm(wire.Arm(**{"label": label} | ORDER | changes))


def record_drop(device: Device, label: int = LABEL, **changes: int) -> Drop:
    device.fire(arm(device, label, **changes))
    return device.collect(label)


def release_drop(device: Device, drop: Drop) -> None:
    """Let the device forget a drop."""
    device.acknowledge(wire.pack_label(*drop.job), drop.certificate.crc32)


def order(**changes: int) -> wire.Arm:
    return wire.Arm(**({"label": LABEL} | ORDER | changes))


def framed(message: wire.Message, seq: int = 1, ack: int = 0) -> bytes:
    """Write a message as it goes over the line."""
    code, payload = wire.pack(message)
    return encode(Frame(code, seq, ack, payload))


def url(scheme: str, protocol: Path = FENCE, **settings: object) -> str:
    """Write the URL of a simulated or an emulated board, every value escaped."""
    said = {"protocol": str(protocol), **settings}
    return f"{scheme}://?" + "&".join(f"{name}={quote(str(value))}" for name, value in said.items())


def connected(where: str, *tap, **options) -> tuple[serial.SerialBase, Device]:
    """Open a port, and connect to the device that is there."""
    port = open_port(where)
    device = Device(port, port_clock(port), *tap)
    device.connect(**options)
    return port, device


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
    """Speaks in single frames, with any seq, once the device has booted."""

    def __init__(self, bench: Bench) -> None:
        self.port, self.clock, self.decoder = bench.port(), bench.clock(), Decoder()
        self.numbers: list[int] = []  # of the device's frames
        self.port.write(b"\0")
        self.hear(BOOT_WAIT_S, until=lambda _, message: isinstance(message, wire.Boot))

    def send(self, code: int, payload: bytes, seq: int) -> None:
        self.port.write(encode(Frame(code, seq, 0, payload)))

    def say(self, message: wire.Message, seq: int) -> None:
        self.send(*wire.pack(message), seq)

    def hear(self, seconds: float = 0.1, until=None) -> list[tuple[int, wire.Message]]:
        """Listen for some time, and only a little longer once `until` was heard."""
        heard, end = [], self.clock.now_ns() + round(seconds * 1e9)
        while self.clock.now_ns() < end:
            for frame in self.decoder.feed(self.port.read(max(1, self.port.in_waiting))):
                self.numbers.append(frame.seq)
                heard.append((frame.ack, wire.unpack(frame.type, frame.payload)))
                if until is not None and until(*heard[-1]):
                    until, end = None, self.clock.now_ns() + 20_000_000
        return heard

    def ask(self, message: wire.Message, seq: int) -> wire.Message:
        self.say(message, seq)
        (answer,) = [m for ack, m in self.hear(until=lambda ack, _: ack == seq) if ack == seq]
        return answer

    def hear_drop(self) -> list[tuple[int, wire.Message]]:
        """Listen until a drop's certificate is in."""
        return self.hear(1.0, until=lambda _, message: isinstance(message, wire.DropCertificate))

    def drop(self, **changes: int) -> tuple[list[wire.Event], wire.DropCertificate]:
        """Arm and fire; return what came of it."""
        self.say(wire.Fire(self.ask(order(**changes), 201).token), 202)
        heard = [message for _, message in self.hear_drop()]
        events = [e for m in heard if isinstance(m, wire.EventsFrame) for e in m.snapshots]
        return events, heard[-1]
