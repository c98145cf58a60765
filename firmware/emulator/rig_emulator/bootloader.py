# SPDX-License-Identifier: GPL-3.0-or-later
"""A board as it is bought: a boot loader in it, and a USB chip that resets it at each opening."""

from __future__ import annotations

import termios
import threading
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from rig_emulator.avr import Avr
from rig_emulator.image import Image, read_image
from sim.pty import DEAF_S
from sim.terminal import Terminal

if TYPE_CHECKING:
    from types import TracebackType

_TICK_S = 1e-3
_LOST_S = 0.02  # a computer too slow for real time lets the board's time lag behind
_FLASH = {"atmega2560": 0x40000, "atmega328p": 0x8000}
# The USB chip is an AVR of 16 MHz too, and 2 % off as the boot loader is. An old Nano's is not, but
# its loader's 2.1 % are well within what silicon understands; the emulator's line is stricter.
_RATES = {termios.B57600: 16e6 / 8 / 34, termios.B115200: 16e6 / 8 / 17, termios.B500000: 5e5}


_ARDUINO = Path("/usr/share/arduino/hardware/arduino/avr/bootloaders")
LOADERS = {
    "mega": _ARDUINO / "stk500v2/stk500boot_v2_mega2560.hex",
    "uno": _ARDUINO / "optiboot/optiboot_atmega328.hex",
    "nano-old": _ARDUINO / "atmega/ATmegaBOOT_168_atmega328.hex",
}
"""Where Debian's `arduino-core-avr` keeps those that boards are sold with."""


def read_loader(mcu: str, path: Path) -> Image:
    """Read a boot loader."""
    # Optiboot's file ends with some bytes for nowhere.
    flash = [piece for piece in read_image(path).flash if piece[0] < _FLASH[mcu]]
    return Image(flash, start=min(address for address, _ in flash))


def behind_loader(mcu: str, loader: Path, program: Path) -> Image:
    """Put a program behind a boot loader, as it is once it was flashed."""
    first, then = read_loader(mcu, loader), read_image(program)
    return replace(then, flash=then.flash + first.flash, start=first.start)


class BoughtBoard:
    """Runs a boot loader, and what it starts, in real time behind `path`, as long as it is entered.

    Parameters
    ----------
    mcu
        As the compiler calls it.
    loader
        Its boot loader, Intel HEX.
    link
        Symbolic link to its terminal.

    Attributes
    ----------
    avr
        The controller.
    path
        Where other programs find it.
    restarts
        How often it was opened.
    heard
        How many bytes came from the host since then.
    lock
        Hold it to touch `avr`.
    """

    def __init__(self, mcu: str, loader: Path, link: Path) -> None:
        self.avr = Avr(read_loader(mcu, loader), mcu)
        self.restarts = self.heard = 0
        self.lock = threading.Lock()
        self._terminal = Terminal(link, held=False)
        self.path = self._terminal.path
        self._deaf_until = 0.0
        self._begun, self._cycles = 0.0, 0
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def __enter__(self) -> BoughtBoard:
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._over.set()
        self._thread.join()
        self._terminal.pull()

    @property
    def is_open(self) -> bool:
        """Whether somebody has the port open, as far as was seen."""
        return self._terminal.is_open

    def pull(self, *, power: bool) -> None:
        """Pull the cable; `power`: the board goes on without it."""
        with self.lock:
            self._terminal.pull()
            if not power:
                self.avr.brown_out()

    def plug(self) -> None:
        """Put the cable in again."""
        with self.lock:
            self._terminal.plug()

    def _run(self) -> None:
        self._begun, self._cycles = time.monotonic(), self.avr.cycle
        while not self._over.wait(_TICK_S):
            with self.lock:
                self._catch_up()

    def _catch_up(self) -> None:
        now = time.monotonic()
        due = self._cycles + round((now - self._begun) * self.avr.frequency)
        late = due - self.avr.cycle - round(_LOST_S * self.avr.frequency)
        if late > 0:
            self._cycles -= late
            due -= late
        if self._terminal.look():
            self.restarts += 1
            self.heard = 0
            self.avr.reset()
            self._deaf_until = now + DEAF_S
        if data := self._terminal.read():
            self.heard += len(data)
            self.avr.rate(_RATES[self._terminal.rate])
            if now >= self._deaf_until:
                self.avr.receive(data)
        self.avr.run(due)
        self._terminal.write(bytes(sent.value for sent in self.avr.take_sent()))
