"""The virtual microcontroller: the same conversation as the firmware, in virtual time.

It is a state machine over a list of things that will happen: bytes that arrive, gates that
change, a recording that ends. `advance` lets them happen up to a moment. Nothing here waits.
"""

from __future__ import annotations

import hashlib
import random
from collections import deque
from operator import itemgetter
from typing import TYPE_CHECKING

from rig.link import messages as wire
from rig.link.frames import DELIMITER, Decoder, crc16
from rig.link.messages import Phase

from .controller import Microcontroller
from .counter import Counter
from .inputs import Inputs
from .transmitter import Transmitter

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from .interfaces import Lab

CAPACITY = 1024
TICK_HZ = 16_000_000
MAX_PULSE_US = 500_000
LATE_TICKS = 256
POWER_ON, EXTERNAL_RESET, BROWN_OUT = 1, 2, 4  # the AVR's PORF, EXTRF and BORF in MCUSR
RESTARTED = 128  # in a certificate, beside the causes
_EXECUTION_NS = 60_000  # from a request's last byte to its execution
HELD = ("label", "fire_tick", "events", "crc32", "overflows")
"""What of a drop's certificate a look into the board shows."""
_BATCH = 16  # events worth a frame of their own
_OLDEST_NS = 10_000_000  # an event waits no longer than this for company
_STEADY_NS = 300_000  # the emergency stop's input is the same for so long
_BOOT_NS = 300_000_000
_CHANNELS = " ".join([f"PB{n}" for n in range(8)] + [f"PK{n}" for n in range(8)])


class VirtualBoard:
    """A microcontroller in front of a lab.

    Parameters
    ----------
    lab
        What the gates see.
    seed
        Chooses unique id, tokens and the counter's start.
    ppm, drift_ppm, wander_ppm
        How the true rate is off `TICK_HZ`: see `sim.counter.Counter`.
    baudrate
        Of the line.
    capacity
        Events that fit its memory.
    streams
        Whether that memory is for the latest events only.
    protocol_version
        What it claims to speak.
    """

    def __init__(
        self,
        lab: Lab,
        seed: int = 0,
        *,
        ppm: float = 0.0,
        drift_ppm: float = 0.0,
        wander_ppm: float = 0.0,
        baudrate: int = 500_000,
        capacity: int = CAPACITY,
        streams: bool = False,
        protocol_version: int = wire.PROTOCOL_VERSION,
    ) -> None:
        self.lab = lab
        self.line = Transmitter(baudrate)
        self.identity = wire.Identity(
            protocol_version=protocol_version,
            board="virtual",
            firmware="sim",
            unique_id=hashlib.sha256(f"virtual board {seed}".encode()).digest()[:8],
            tick_hz=TICK_HZ,
            gates=16,
            releases=4,
            max_pulse_us=MAX_PULSE_US,
            capacity=capacity,
            streams=int(streams),
            late_ticks=LATE_TICKS,
            channels=_CHANNELS,
        )
        self._random = random.Random(f"board {seed}")
        start = self._random.getrandbits(32)
        self.counter = Counter(
            TICK_HZ, ppm, start, drift_ppm=drift_ppm, wander_ppm=wander_ppm, seed=seed
        )
        self._now_ns = 0
        self._boot_ns: int | None = None
        self._boot_cause = EXTERNAL_RESET
        self._inputs = Inputs()
        self._forget()

    def receive(self, start_ns: int, data: bytes) -> None:
        """Take bytes from the host.

        Parameters
        ----------
        start_ns
            When the first begins to arrive; they follow each other at line rate.
        data
            The bytes.
        """
        at = start_ns
        for piece in data.split(DELIMITER):
            at += (len(piece) + 1) * self.line.byte_ns
            self._inbox.append((at, piece + DELIMITER))
        # The last piece has no delimiter behind it.
        at, piece = self._inbox.pop()
        if piece != DELIMITER:
            self._inbox.append((at - self.line.byte_ns, piece[:-1]))

    def reset(self, at_ns: int, cause: int = EXTERNAL_RESET) -> None:
        """Restart, as opening the port does to a Mega; all is forgotten but a drop it holds.

        Parameters
        ----------
        at_ns
            When.
        cause
            For the BOOT frame; after `POWER_ON` the drop is forgotten too.
        """
        self.advance(at_ns)
        self.line.clear(at_ns)
        before = self._controller
        self._forget((0 if cause & POWER_ON else before.restarts) | RESTARTED | cause)
        if before.drop is not None and before.phase is Phase.HOLDING and not cause & POWER_ON:
            self._controller.drop = before.drop
            before.drop.aborted = False  # so it must be acknowledged
        self.counter.start = self._random.getrandbits(32)
        self._boot_ns = at_ns + _BOOT_NS
        self._boot_cause = cause

    def brown_out(self, at_ns: int) -> None:
        """Let its supply sink so far that it restarts; its memory stays."""
        self.reset(at_ns, BROWN_OUT)

    def touch(self, gates: int) -> None:
        """Change the beams by hand, now (arming asks the lab again).

        Parameters
        ----------
        gates
            Mask of the blocked ones from now on.
        """
        self._controller.touch(gates)

    def stop(self, opened: bool) -> None:
        """Open or close the emergency stop, now; what is over too soon does not count."""
        turned = opened != self._inputs.stopped
        self._inputs.stop_turns_ns = self._now_ns + _STEADY_NS if turned else None

    def reference(self, times_ns: Iterable[int], period_ns: int = 0) -> None:
        """Have the 1 Hz reference give pulses.

        Parameters
        ----------
        times_ns
            When, in order of time.
        period_ns
            How it goes on after these; 0 for not at all.
        """
        self._inputs.pulses_ns.extend(times_ns)
        self._inputs.period_ns = period_ns

    def sense(self, seconds: float | None) -> None:
        """Have the release-sense input change so long after each FIRE to come, or never."""
        self._inputs.sense_s = seconds

    def outputs(self) -> int:
        """Mask of the release outputs that are on now."""
        return self._controller.release.on(self._now_ns)

    def phase(self) -> Phase:
        """Tell what it is doing."""
        return self._controller.phase

    def held(self) -> tuple[dict[str, int], list[tuple[int, int]]]:
        """Tell what it keeps of the drop it holds: the certificate's main fields, the events."""
        drop = self._controller.drop
        assert drop is not None
        events: list[tuple[int, int]] = []
        while part := drop.part(len(events), wire.EVENTS_PER_FRAME).snapshots:
            events += [(event.tick, event.state) for event in part]
        certificate = drop.certificate()
        return {name: getattr(certificate, name) for name in HELD}, events

    def advance(self, until_ns: int) -> None:
        """Let happen what happens until a moment."""
        while (upcoming := self._upcoming()) is not None and upcoming[0] <= until_ns:
            self._now_ns = max(self._now_ns, upcoming[0])
            upcoming[1]()
        self._now_ns = max(self._now_ns, until_ns)

    def next_ns(self) -> int | None:
        """Say when something will happen next, or `None` when nothing will."""
        when_ns, _ = self._upcoming() or (None, None)
        return when_ns

    def _forget(self, restarts: int = 0) -> None:
        self._decoder = Decoder()
        self._inbox: deque[tuple[int, bytes]] = deque()
        self._last: tuple[int, int, int] | None = None  # type, seq and CRC of the last request
        self._answer = b""
        self._controller = Microcontroller(
            self.lab, self.counter, self.identity, self._inputs, self._random, restarts
        )
        self._oldest_ns = 0

    def _upcoming(self) -> tuple[int, Callable[[], None]] | None:
        """Find what happens next. Sending is polled: meanwhile only interrupts happen."""
        if self._boot_ns is not None:
            return self._boot_ns, self._boot
        state, inputs = self._controller, self._inputs
        interrupts = (
            (inputs.stop_turns_ns, self._stop_turns),
            (inputs.pulses_ns[0] if inputs.pulses_ns else None, self._reference_pulse),
            (state.coming[0].when_ns if state.coming else None, self._gate_changes),
            (state.sense_ns, self._sense),
        )
        polled = (
            (state.end_ns, self._close),
            (self._stream_ns(), self._stream),
            (state.lapses_ns if state.order is not None else None, self._lapse),
            (self._inbox[0][0] + _EXECUTION_NS if self._inbox else None, self._listen),
        )
        upcoming = [(when_ns, act) for when_ns, act in interrupts if when_ns is not None]
        upcoming += [(max(at, self.line.free_ns), act) for at, act in polled if at is not None]
        return min(upcoming, key=itemgetter(0), default=None)

    def _stream_ns(self) -> int | None:
        """While recording: when events are sent, at once if they fill a frame."""
        drop = self._controller.drop
        if self._controller.end_ns is None or drop is None or not drop.unsent:
            return None
        return self._now_ns if drop.unsent >= _BATCH else self._oldest_ns + _OLDEST_NS

    def _boot(self) -> None:
        self._boot_ns = None
        self._inbox.clear()  # nobody listened
        while self._inputs.pulses_ns and self._inputs.pulses_ns[0] <= self._now_ns:
            self._inputs.pulse()
        self.line.send(self._now_ns, DELIMITER)  # the reset may have cut a frame short
        self._send(wire.Boot(self._boot_cause))

    def _gate_changes(self) -> None:
        state = self._controller
        change = state.coming.popleft()
        if state.drop is not None:
            state.gates = state.gates & ~state.drop.order.gates | change.state
            if not state.drop.unsent:
                self._oldest_ns = change.when_ns
            state.drop.store(change.tick, change.state)

    def _reference_pulse(self) -> None:
        self._controller.reference_pulse(self.counter.tick_at(self._inputs.pulse()))

    def _sense(self) -> None:
        state = self._controller
        if state.drop is not None and state.sense_ns is not None:
            state.drop.sense_tick = self.counter.tick_at(state.sense_ns)
        state.sense_ns = None

    def _stream(self) -> None:
        drop = self._controller.drop
        if drop is not None:
            part = drop.part(drop.sent, wire.EVENTS_PER_FRAME)
            drop.sent += len(part.snapshots)
            self._oldest_ns = self._now_ns
            self._send(part)

    def _close(self) -> None:
        state = self._controller
        state.close()
        if state.drop is not None:
            while state.drop.unsent:
                self._stream()
            self._send(state.drop.certificate())

    def _lapse(self) -> None:
        self._tell(self._controller.lapse(self._now_ns))

    def _tell(self, disarmed: wire.Disarmed | None) -> None:
        if disarmed is not None:
            self._send(disarmed)

    def _send(self, message: wire.DeviceMessage) -> None:
        self.line.send(self._now_ns, self.line.frame(message, ack=0))

    def _stop_turns(self) -> None:
        inputs = self._inputs
        inputs.stopped, inputs.stop_turns_ns = not inputs.stopped, None
        if inputs.stopped:
            self._tell(self._controller.stop(self._now_ns))

    def _listen(self) -> None:
        _, data = self._inbox.popleft()
        for frame in self._decoder.feed(data):
            this = (frame.type, frame.seq, crc16(bytes(frame[:3]) + frame.payload))
            if frame.seq == 0:
                continue  # could not be answered
            self._controller.heard(self._now_ns)
            if this != self._last:
                self._last = this
                answer = self._controller.answer(frame, self._now_ns)
                self._answer = self.line.frame(answer, ack=frame.seq)
            self.line.send(self._now_ns, self._answer)
