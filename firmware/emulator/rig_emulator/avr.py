# SPDX-License-Identifier: GPL-3.0-or-later
"""One emulated controller: cycles, pins, bytes, memory."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from rig.errors import InputError
from rig_emulator._harness import ffi, lib
from rig_emulator.controller import Change, EmulatorError, Sent, Stop
from rig_emulator.image import Image, read_image

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

FILL = 0xC5
"""What RAM holds at power-up, so that the stack leaves a mark."""
_FOR_EVER = b"\xff\xcf"  # rjmp to itself
_ROOM = 256  # of the buffers in which C hands over what happened
_COLOURS = re.compile("\x1b\\[[0-9;]*m")


class Avr:
    """An AVR with its program, stopped at cycle 0 after power-up.

    Parameters
    ----------
    program
        A firmware file, or one that was read already.
    mcu
        As the compiler calls it, ``"atmega2560"`` or ``"atmega328p"``.
    frequency
        Of the crystal, Hz.
    baudrate
        Of the host at the other end of UART 0.
    """

    def __init__(
        self,
        program: Path | Image,
        mcu: str,
        frequency: int = 16_000_000,
        baudrate: float = 500_000,
    ) -> None:
        image = program if isinstance(program, Image) else read_image(program)
        board = lib.board_new(mcu.encode(), frequency, FILL)
        if board == ffi.NULL:
            raise InputError(f"the emulator knows no controller {mcu!r}")
        self._board: Any = ffi.gc(board, lib.board_free)
        self._changes: Any = ffi.new("change_t[]", _ROOM)
        self._sent: Any = ffi.new("sent_t[]", _ROOM)
        self.symbols: Mapping[str, Any] = image.symbols
        for address, data in image.flash:
            if lib.board_flash(self._board, address, data, len(data)):
                raise InputError(f"the program is too large for {mcu}")
        for address, data in image.eeprom:
            self.eeprom_write(address, data)
        if image.start:
            lib.board_start_at(self._board, image.start)
        self.frequency = frequency
        self.rate(baudrate)

    # -- time

    @property
    def cycle(self) -> int:
        """Cycles since power-up; they go on over resets."""
        return int(lib.board_cycle(self._board))

    def run(self, until: int, *, stop_on_sent: bool = False) -> Stop:
        """Let it work.

        Parameters
        ----------
        until
            Cycle; it stops at the first instruction that begins then or later.
        stop_on_sent
            Come back as soon as a byte begins to be sent.

        Returns
        -------
        Stop
            `Stop.PIN` when a watched pin changed before `until`.

        Raises
        ------
        EmulatorError
            When the firmware crashed or sleeps for good. `reset` mends that.
        """
        why = lib.board_run(self._board, until, stop_on_sent)
        if why < 0:
            fault = ffi.string(lib.board_fault(self._board)).decode("ascii", "replace")
            fault = _COLOURS.sub("", fault)
            raise EmulatorError(f"the emulated board failed at cycle {self.cycle}: {fault}")
        return Stop(why)

    def reset(self) -> None:
        """Pull the reset pin; RAM and EEPROM stay, and what comes on the wires."""
        lib.board_reset(self._board)

    def brown_out(self) -> None:
        """Let the supply sink so far that it restarts; RAM stays as it was."""
        lib.board_brown_out(self._board)

    def rate(self, baudrate: float) -> None:
        """Let the host at the other end of UART 0 take another rate."""
        lib.board_line(self._board, round(10 * self.frequency / baudrate))

    @property
    def watchdog_resets(self) -> int:
        """How often the watchdog has bitten."""
        return int(lib.board_watchdog_resets(self._board))

    @property
    def timers(self) -> int:
        """How many things simavr waits for, edges aside: what is due every cycle makes it slow."""
        return int(lib.board_timers(self._board))

    # -- pins

    def edge(self, cycle: int, pin: str, level: bool) -> None:
        """Give a pin a level from outside, from `cycle` on (what is over means now)."""
        self._pin(pin, lambda b, port, bit: lib.board_edge(b, cycle, port, bit, level))

    def clear_edges(self, pin: str) -> None:
        """Forget the edges that are still to come at a pin."""
        self._pin(pin, lib.board_clear_edges)

    @property
    def edges_left(self) -> int:
        """How many edges are still to come."""
        return int(lib.board_edges_left(self._board))

    def watch(self, pin: str, on: bool = True) -> None:
        """Let `run` come back when this output changes."""
        self._pin(pin, lambda b, port, bit: lib.board_watch(b, port, bit, on))

    def output(self, pin: str) -> bool:
        """Whether the pin is driven high now."""
        return bool(self._pin(pin, lib.board_output))

    def take_changes(self) -> list[Change]:
        """Take what the output pins did since the last time."""
        taken: list[Change] = []
        while n := lib.board_take_changes(self._board, self._changes, _ROOM):
            taken += [
                Change(c.cycle, f"P{c.port.decode()}{c.pin}", bool(c.high))
                for c in self._changes[0:n]
            ]
        return taken

    def _pin(self, pin: str, call: Callable[[Any, bytes, int], int]) -> int:
        good = len(pin) == 3 and pin[0] == "P" and pin[2] in "01234567"
        done = call(self._board, pin[1].encode(), int(pin[2])) if good else -1
        if done < 0:
            raise ValueError(f"no pin {pin!r} here")
        return done

    # -- UART 0

    def receive(self, data: bytes, cycle: int = 0) -> None:
        """Send it bytes at line rate, not before `cycle`."""
        lib.board_receive(self._board, cycle, data, len(data))

    def take_sent(self) -> list[Sent]:
        """Take the bytes whose sending began since the last time."""
        taken: list[Sent] = []
        while n := lib.board_take_sent(self._board, self._sent, _ROOM):
            taken += [Sent(s.cycle, s.value) for s in self._sent[0:n]]
        return taken

    @property
    def overruns(self) -> int:
        """Bytes lost because the firmware did not fetch them in time."""
        return int(lib.board_overruns(self._board))

    # -- memory

    def peek(self, place: str | int, size: int | None = None) -> bytes:
        """Read RAM at a symbol (all of it unless told) or an address."""
        address, known = self._place(place)
        data = ffi.new("uint8_t[]", known if size is None else size)
        self._fits(lib.board_peek(self._board, address, data, len(data)), place)
        return bytes(data)

    def poke(self, place: str | int, data: bytes) -> None:
        """Write RAM at a symbol or an address."""
        address, known = self._place(place)
        if isinstance(place, str) and len(data) > known:
            raise ValueError(f"{place} has {known} bytes, not {len(data)}")
        self._fits(lib.board_poke(self._board, address, data, len(data)), place)

    def number(self, symbol: str) -> int:
        """Read an unsigned variable."""
        return int.from_bytes(self.peek(symbol), "little")

    def stack_free(self) -> int:
        """Count the bytes between the variables and the deepest the stack has ever been.

        Raises
        ------
        ValueError
            When the program came without symbols.
        """
        start, _ = self._place("_end")
        return len(free := self.peek(start, lib.board_ram_end(self._board) + 1 - start)) - len(
            free.lstrip(bytes([FILL]))
        )

    def program(self, address: int, size: int) -> bytes:
        """Read the flash."""
        data = ffi.new("uint8_t[]", size)
        self._fits(lib.board_program(self._board, address, data, size), address)
        return bytes(data)

    def eeprom_read(self, address: int, size: int) -> bytes:
        """Read the EEPROM."""
        data = ffi.new("uint8_t[]", size)
        self._fits(lib.board_eeprom_get(self._board, address, data, size), address)
        return bytes(data)

    def eeprom_write(self, address: int, data: bytes) -> None:
        """Preset the EEPROM (empty cells are 0xFF)."""
        self._fits(lib.board_eeprom_set(self._board, address, data, len(data)), address)

    def hang(self, function: str) -> None:
        """Let a function of the program be an endless loop from now on."""
        symbol = self.symbols[function]
        self._fits(
            lib.board_flash(self._board, symbol.address, _FOR_EVER, len(_FOR_EVER)), function
        )

    def _place(self, place: str | int) -> tuple[int, int]:
        if isinstance(place, int):
            return place, 1
        symbol = self.symbols.get(place)
        if symbol is None or symbol.flash:
            raise ValueError(f"the program has no variable {place!r} (or came without symbols)")
        return symbol.address, symbol.size

    def _fits(self, done: int, place: str | int) -> None:
        if done < 0:
            raise ValueError(f"{place}: beyond the memory's end")
