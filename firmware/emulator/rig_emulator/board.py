# SPDX-License-Identifier: GPL-3.0-or-later
"""A whole board in virtual time: the firmware, and the lab around its pins."""

from __future__ import annotations

import hashlib
import math
from collections import deque
from typing import TYPE_CHECKING

from rig.link import messages as wire
from rig.link.frames import Decoder
from rig_emulator.avr import Avr
from rig_emulator.controller import Change, Controller, Stop
from rig_emulator.line import LineToHost
from rig_emulator.name import NAME_AT, name_record

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from pathlib import Path

    from rig.link.frames import Frame
    from rig_emulator.image import Image
    from rig_emulator.wiring import Wiring
    from sim.interfaces import Lab

_ARM = wire.CODES[wire.Arm]
_ARMED = wire.CODES[wire.Armed]
_BOOT = wire.CODES[wire.Boot]
_POWERED_S = 0.1  # the board has been on for a while when the port is opened
_PULSE_NS = 10**7  # width of the reference's pulses
_HISTORY = 10_000
_WIRE_NS = 400_000  # for which an edge is under way to another board: both keep step so closely


class EmulatedBoard:
    """Same interface as `sim.board.VirtualBoard`, but the real program inside.

    The lab is hung while ARM is on its way to the board, and let go when the sync output rises.

    Parameters
    ----------
    wiring
        The board.
    program
        Its firmware.
    lab
        What the gates see; `None`: nothing ever happens.
    seed
        Chooses unique id and the phase of the counter.
    ppm
        How far the board's clock is off; virtual nanoseconds are true ones.
    baudrate
        Of the host.

    Attributes
    ----------
    avr
        The controller.
    line
        What it sends.
    history
        What its output pins did of late.
    runs
        Whether the firmware has said that it runs: before it, a boot loader may.
    wires
        By output pin the pins that it is joined to, and their boards.
    beside
        Another board, which keeps step; wires may join them.
    second_ns
        Period of a 1 Hz reference that gives pulses from now on; `None`: none is wired.
    """

    def __init__(
        self,
        wiring: Wiring,
        program: Path | Image,
        lab: Lab | None = None,
        seed: int = 0,
        *,
        ppm: float = 0.0,
        baudrate: int = 500_000,
    ) -> None:
        self.wiring = wiring
        self.lab = lab
        self.hz = wiring.clock_hz * (1.0 + ppm * 1e-6)
        self.history: deque[Change] = deque(maxlen=_HISTORY)
        draw = hashlib.sha256(f"emulated board {seed}".encode()).digest()
        self.avr = self.controller(wiring, program, baudrate, draw[:8])
        self.line = LineToHost(baudrate)
        self.avr.watch(wiring.sync)
        for pin in (*wiring.gates, wiring.stop, wiring.reference, wiring.sense):
            if pin is not None:
                self.avr.edge(0, pin, False)
        self.runs = False
        self._sense_s: float | None = None
        self.wires: dict[str, list[tuple[EmulatedBoard, str]]] = {}
        self.beside: EmulatedBoard | None = None
        self.second_ns: int | None = None
        self._pulses = 0
        self._sniff()
        self._origin = 0
        self._run(round(_POWERED_S * wiring.clock_hz) + int.from_bytes(draw[8:10]))
        self._origin = self.avr.cycle
        self.line = LineToHost(baudrate)  # nobody listened

    def controller(
        self, wiring: Wiring, program: Path | Image, baudrate: int, name: bytes
    ) -> Controller:
        """Put the controller on the board, with the program in it and the name it gave itself."""
        avr = Avr(program, wiring.mcu, wiring.clock_hz, baudrate)
        avr.eeprom_write(NAME_AT, name_record(name))
        return avr

    # -- what a port needs

    def receive(self, start_ns: int, data: bytes) -> None:
        """Take bytes from the host.

        Parameters
        ----------
        start_ns
            When the first begins to arrive; they follow each other at line rate.
        data
            The bytes.
        """
        for frame in self._to_board.feed(data):
            if frame.type == _ARM:
                self._hang(frame)
        self.avr.receive(data, self.cycle_at(start_ns))

    def reset(self, at_ns: int) -> None:
        """Pull the reset pin, as opening the port does."""
        self._restart(at_ns, self.avr.reset)

    def brown_out(self, at_ns: int) -> None:
        """Let the supply sink for a moment."""
        self._restart(at_ns, self.avr.brown_out)

    def _restart(self, at_ns: int, how: Callable[[], None]) -> None:
        self.advance(at_ns)
        self.line.cut(at_ns)
        how()
        self.runs = False
        self._sniff()
        self.history.extend(self.avr.take_changes())

    def advance(self, until_ns: int) -> None:
        """Let the firmware work until a moment."""
        self._run(self.cycle_at(until_ns))

    def listen(self, until_ns: int) -> int | None:
        """Let it work until a byte begins to be sent, at most until a moment.

        Parameters
        ----------
        until_ns
            The host is silent at least until then.

        Returns
        -------
        int or None
            When the host gets the next byte.
        """
        if self.line.next_arrival_ns() is None:
            self._run(self.cycle_at(until_ns), stop_on_sent=True)
        return self.line.next_arrival_ns()

    def next_ns(self) -> int | None:
        """Nobody knows what a program will do next, so: now."""
        return self.ns_at(self.avr.cycle)

    # -- hands around it

    def touch(self, gates: int) -> None:
        """Change the beams by hand, now: mask of the blocked ones."""
        for channel, pin in enumerate(self.wiring.gates):
            self.avr.edge(0, pin, bool(gates >> channel & 1))

    def stop(self, opened: bool) -> None:
        """Open or close the emergency stop, now."""
        self.avr.edge(0, self.wiring.stop, opened)

    def reference(self, times_ns: Iterable[int]) -> None:
        """Have the 1 Hz reference give pulses.

        Parameters
        ----------
        times_ns
            When each rises.
        """
        for rise_ns in times_ns:
            self.avr.edge(self.cycle_at(rise_ns), self.wiring.reference, True)
            self.avr.edge(self.cycle_at(rise_ns + _PULSE_NS), self.wiring.reference, False)

    def sense(self, seconds: float | None) -> None:
        """Have the release-sense input change so long after each FIRE to come, or never."""
        self._sense_s = seconds

    def loop_back(self, gate: int) -> None:
        """Join the sync output to a gate input with a wire."""
        self.wires[self.wiring.sync] = [(self, self.wiring.gates[gate])]

    def outputs(self) -> int:
        """Mask of the release outputs that are on now."""
        return sum(self.avr.output(pin) << n for n, pin in enumerate(self.wiring.releases))

    def cycle_at(self, ns: int) -> int:
        """Convert true time to the board's cycles."""
        return self._origin + round(ns * 1e-9 * self.hz)

    def ns_at(self, cycle: int) -> int:
        """Convert the board's cycles to true time, at or after it."""
        return math.ceil((cycle - self._origin) / self.hz * 1e9)

    # -- inside

    def _sniff(self) -> None:
        self._to_board, self._to_host = Decoder(), Decoder()
        self._asked: dict[int, int] = {}  # labels of ARM requests by seq
        self._label: int | None = None  # of the last that was granted

    def _hang(self, frame: Frame) -> None:
        try:
            order = wire.unpack(frame.type, frame.payload)
        except wire.MessageError:
            return
        if not isinstance(order, wire.Arm) or self.avr.output(self.wiring.sync):
            return  # while chains fall, nobody hangs others
        self._asked[frame.seq] = order.label
        if self.lab is not None:
            for pin in self.wiring.gates:
                self.avr.clear_edges(pin)
            self.touch(self.lab.rest(order.label))

    def _run(self, until: int, *, stop_on_sent: bool = False) -> None:
        while self.beside is not None and self.avr.cycle < until:
            self._work(min(until, self.cycle_at(self.ns_at(self.avr.cycle) + _WIRE_NS)))
            self.beside._work(self.beside.cycle_at(self.ns_at(self.avr.cycle)))
            if stop_on_sent and self.line.next_arrival_ns() is not None:
                return
        self._work(until, stop_on_sent=stop_on_sent)

    def _work(self, until: int, *, stop_on_sent: bool = False) -> None:
        self._pulse(until)
        while True:
            why = self.avr.run(until, stop_on_sent=stop_on_sent)
            for cycle, value in self.avr.take_sent():
                self.line.put(self.ns_at(cycle), value)
                for frame in self._to_host.feed(bytes([value])):
                    self.runs |= frame.type == _BOOT
                    if frame.type == _ARMED and frame.ack in self._asked:
                        self._label = self._asked[frame.ack]
            for change in self.avr.take_changes():
                self.history.append(change)
                for board, pin in self.wires.get(change.pin, ()):
                    ns = self.ns_at(change.cycle) + _WIRE_NS * (board is not self)
                    board.avr.edge(board.cycle_at(ns), pin, change.high)
                if change.pin == self.wiring.sync and change.high:
                    self._let_go(change.cycle)
            if why is not Stop.PIN:
                return

    def _pulse(self, until: int) -> None:
        """Wire the reference's pulses up to a cycle."""
        while self.second_ns is not None:
            due_ns = (self._pulses + 1) * self.second_ns
            if self.cycle_at(due_ns) >= until:
                break
            self.reference([due_ns])
            self._pulses += 1

    def _let_go(self, cycle: int) -> None:
        if self._sense_s is not None and self.wiring.sense is not None:
            self.avr.edge(cycle + round(self._sense_s * self.hz), self.wiring.sense, True)
        if self.lab is None or self._label is None:
            return
        for seconds, channel, blocked in self.lab.drop(self._label):
            self.avr.edge(cycle + round(seconds * self.hz), self.wiring.gates[channel], blocked)
