# SPDX-License-Identifier: GPL-3.0-or-later
"""A test stand: edges at exact cycles in, the firmware's own stamps out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from rig.errors import DeviceError
from rig.link import messages as wire
from rig.link.frames import Decoder, Frame, encode
from rig_emulator.avr import Avr
from rig_emulator.name import NAME_AT, name_record
from rig_emulator.pico_chip import PicoChip
from rig_emulator.wiring import PICO

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from pathlib import Path

    from rig_emulator.controller import Change
    from rig_emulator.wiring import Wiring

_BOOT_CYCLES, _SLOW_BOOT_CYCLES = 500_000, 1_600_000  # the Pico waits for its crystal
_ANSWER_CYCLES = 800_000
_TRIES = 5
_LABEL = wire.pack_label(1, 1)


def powered(wiring: Wiring, program: Path, baudrate: int, named: bytes) -> Any:
    """Power a controller up, with its program, its name and its line; tests know which one.

    Parameters
    ----------
    wiring, program, baudrate, named
        See `Stand`.
    """
    if wiring is PICO:
        chip = PicoChip(program, named)
        chip.open()
        return chip
    avr = Avr(program, wiring.mcu, baudrate=baudrate)
    avr.eeprom_write(NAME_AT, name_record(named) if named else bytes(16))
    return avr


class Flip(NamedTuple):
    """A gate that changes, so many cycles after FIRE."""

    cycle: int
    gate: int
    blocked: bool


class Stamp(NamedTuple):
    """What became of a flip.

    Attributes
    ----------
    flip
        The flip.
    error
        Its stamp less its cycle.
    doubtful
        Whether the host can see that the stamp may be off by more than usual: the event follows
        close behind another, or tells of several gates at once.
    """

    flip: Flip
    error: int
    doubtful: bool


@dataclass(frozen=True)
class Recording:
    """A drop as the firmware recorded it; ticks count from FIRE.

    Attributes
    ----------
    events
        In order; `tick` may be negative.
    certificate
        The firmware's account.
    late_ticks
        The firmware's rule for late stamps.
    outputs
        What the output pins did; cycles count from FIRE too.
    tick_cycles
        Cycles in a tick.
    """

    events: list[wire.Event]
    certificate: wire.DropCertificate
    late_ticks: int
    outputs: list[Change]
    tick_cycles: int = 1

    def stamps(self, flips: Iterable[Flip]) -> list[Stamp]:
        """Set events beside what happened.

        Parameters
        ----------
        flips
            Everything that happened, in order of time.

        Returns
        -------
        list of Stamp
            One a flip, in the order in which the firmware saw them.

        Raises
        ------
        DeviceError
            When the events do not tell the same story.
        """
        waiting: dict[int, list[Flip]] = {}
        for flip in flips:
            waiting.setdefault(flip.gate, []).append(flip)
        stamps = []
        before, last = 0, -(1 << 31)
        for tick, state in self.events:
            changed = before ^ state
            doubtful = tick - last < self.late_ticks or changed.bit_count() > 1
            for gate in range(16):
                if changed >> gate & 1:
                    queue = waiting.get(gate, [])
                    if not queue or queue[0].blocked != bool(state >> gate & 1):
                        raise DeviceError(f"an edge of gate {gate} that nothing made")
                    flip = queue.pop(0)
                    stamps.append(Stamp(flip, tick * self.tick_cycles - flip.cycle, doubtful))
            before, last = state, tick
        lost = sum(len(queue) for queue in waiting.values())
        if lost:
            raise DeviceError(f"{lost} edges left no event")
        return stamps


class Stand:
    """A board on the stand, booted and connected.

    Parameters
    ----------
    wiring
        The board.
    program
        Its firmware.
    baudrate
        Of the line; the firmware must have been built for it.
    named
        The board's own name, eight bytes; empty for an EEPROM of zeros.
    waits
        Cycles before it is first asked who it is.

    Attributes
    ----------
    avr
        The controller.
    identity
        What it said it is.
    fire_sent, fired, certified
        Cycles at which the latest FIRE began to be sent, it acted, and its drop's certificate was
        there.
    heard
        How many bytes it has sent.
    """

    def __init__(
        self,
        wiring: Wiring,
        program: Path,
        baudrate: int = 500_000,
        named: bytes = b"on stand",
        waits: int = 0,
    ) -> None:
        self.wiring = wiring
        self.avr = powered(wiring, program, baudrate, named)
        self._decoder = Decoder()
        self._seq = 0
        self._ahead = 0  # of the board's ticks before its cycles
        self.fire_sent = self.fired = self.certified = self.heard = self._latest = 0
        for pin in (*wiring.gates, wiring.stop):
            self.avr.edge(0, pin, False)
        slow = wiring.clock_hz > 16_000_000
        self.hear(self._scaled(_SLOW_BOOT_CYCLES if slow else _BOOT_CYCLES) + waits)
        identity = self.ask(wire.Identify())
        if not isinstance(identity, wire.Identity):
            raise DeviceError(f"the board answers IDENTIFY with {identity}")
        self.identity = identity

    def _scaled(self, avr_cycles: int) -> int:
        return avr_cycles * self.wiring.clock_hz // 16_000_000

    def hear(self, cycles: int) -> list[wire.Message]:
        """Let it work and take what it says."""
        end = self.avr.cycle + cycles
        while self.avr.run(end):
            pass
        sent = self.avr.take_sent()
        self.heard += len(sent)
        if sent:
            self._latest = sent[-1].cycle
        data = bytes(one.value for one in sent)
        return [wire.unpack(frame.type, frame.payload) for frame in self._decoder.feed(data)]

    def send(self, request: wire.HostMessage) -> bytes:
        """Send a request, and wait for nothing; return what was sent."""
        self._seq = self._seq % 255 + 1
        code, payload = wire.pack(request)
        frame = b"\0" + encode(Frame(code, self._seq, 0, payload))
        self.avr.receive(frame)
        return frame

    def ask(self, request: wire.HostMessage, cycles: int = _ANSWER_CYCLES) -> wire.Message:
        """Send a request, again if need be, and take the first answer; wait as at 16 MHz."""
        frame = self.send(request)
        for _ in range(_TRIES):
            if heard := self.hear(self._scaled(cycles)):
                return heard[0]
            self.avr.receive(frame)
        raise DeviceError(f"the board does not answer {request}")

    def tick_at(self, cycle: int) -> int:
        """Say what the board's time is at a cycle; right once there was a drop."""
        return (cycle + self._ahead) % 2**32

    def record(
        self,
        flips: list[Flip] | Callable[[int], list[Flip]],
        record_ms: int,
        noise: bytes = b"",
        pulse_us: int = 0,
    ) -> Recording:
        """Arm, fire, and let gates change.

        Parameters
        ----------
        flips
            What happens, in order of time; every gate begins clear. Or what says so, given the
            cycle of FIRE.
        record_ms
            For ARM.
        noise
            Bytes the host sends meanwhile, though it should keep silent.
        pulse_us
            For ARM, of all releases; 0 for none.

        Returns
        -------
        Recording
            What the firmware sent by itself, its drop acknowledged.
        """
        fire, changes = self.arm_and_fire(record_ms, pulse_us)
        for flip in flips if isinstance(flips, list) else flips(fire):
            self.avr.edge(fire + flip.cycle, self.wiring.gates[flip.gate], flip.blocked)
        self.avr.receive(noise)
        heard = self.hear(self._scaled(record_ms * 16_000))
        while not isinstance(heard[-1], wire.DropCertificate):
            heard += self.hear(self._scaled(160_000))
        certificate, self.certified = heard[-1], self._latest
        self._ahead = certificate.fire_tick - fire
        raw = [event for m in heard if isinstance(m, wire.EventsFrame) for event in m.snapshots]
        events = [
            wire.Event((e.tick - certificate.fire_tick + 2**31) % 2**32 - 2**31, e.state)
            for e in raw
        ]
        for pin in self.wiring.gates:
            self.avr.edge(0, pin, False)
        self.ask(wire.Acknowledge(_LABEL, certificate.crc32), 100_000)
        outputs = [c._replace(cycle=c.cycle - fire) for c in changes + self.avr.take_changes()]
        return Recording(
            events, certificate, self.identity.late_ticks, outputs, self.wiring.tick_cycles
        )

    def record_all(self, flips: list[Flip], pulse_us: int = 0) -> Recording:
        """Record for as long as gates change."""
        record_ms = flips[-1].cycle // (self.wiring.clock_hz // 1000) + 5
        return self.record(flips, record_ms, pulse_us=pulse_us)

    def stamps_of(self, flips: list[Flip]) -> list[Stamp]:
        """Let gates change, and tell how each was stamped."""
        return self.record_all(flips).stamps(flips)

    def arm_and_fire(self, record_ms: int, pulse_us: int) -> tuple[int, list[Change]]:
        """Begin a drop of all gates and all releases.

        Returns
        -------
        int, list of Change
            The cycle of FIRE, and what the outputs did up to now.
        """
        gates = (1 << len(self.wiring.gates)) - 1
        release = (1 << len(self.wiring.releases)) - 1 if pulse_us else 0
        order = wire.Arm(_LABEL, gates, release, pulse_us, 200, record_ms)
        armed = self.ask(order, 100_000)
        if not isinstance(armed, wire.Armed):
            raise DeviceError(f"the board answers ARM with {armed}")
        self.avr.watch(self.wiring.sync)
        self.avr.take_changes()
        changes: list[Change] = []
        self.fire_sent = self.avr.cycle
        frame = self.send(wire.Fire(armed.token))
        while True:
            self.avr.run(self.avr.cycle + self._scaled(100_000))
            changes += self.avr.take_changes()
            if begun := [c.cycle for c in changes if c.pin == self.wiring.sync]:
                break
            self.avr.receive(frame)
        self.fired = begun[0] + self.wiring.sync_lead
        return self.fired, changes
