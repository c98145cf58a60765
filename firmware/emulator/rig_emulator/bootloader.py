# SPDX-License-Identifier: GPL-3.0-or-later
"""A board as it is bought: a boot loader in it, and a USB chip that resets it at each opening."""

from __future__ import annotations

import contextlib
import os
import pty
import select
import termios
import threading
import time
import tty
from typing import TYPE_CHECKING

from rig_emulator.avr import Avr
from rig_emulator.image import Image, read_image

if TYPE_CHECKING:
    from pathlib import Path
    from types import TracebackType

_DEAF_S = 0.065  # the reset pin is held low so long when the port is opened
_TICK_S = 1e-3
_FLASH = {"atmega2560": 0x40000, "atmega328p": 0x8000}
# The USB chip is an AVR of 16 MHz too, and 2 % off as the boot loader is.
_RATES = {termios.B57600: 16e6 / 8 / 35, termios.B115200: 16e6 / 8 / 17, termios.B500000: 5e5}


class BoughtBoard:
    """Runs a boot loader, and what it starts, in real time behind `path`, as long as it is entered.

    Parameters
    ----------
    mcu
        As the compiler calls it.
    loader
        Its boot loader, Intel HEX.

    Attributes
    ----------
    avr
        The controller.
    path
        Where other programs find it.
    is_open
        Whether somebody has the port open, as far as was seen.
    restarts
        How often it was opened.
    lock
        Hold it to touch `avr`.
    """

    def __init__(self, mcu: str, loader: Path) -> None:
        # Optiboot's file ends with some bytes for nowhere.
        image = Image([piece for piece in read_image(loader).flash if piece[0] < _FLASH[mcu]])
        self.avr = Avr(image, mcu)
        self.avr.start_at(min(address for address, _ in image.flash))
        self.restarts = 0
        self.lock = threading.Lock()
        self._far, near = pty.openpty()
        tty.setraw(near)
        self.path = os.ttyname(near)
        os.close(near)  # so that it shows when somebody opens it
        self._poll = select.poll()
        self.is_open, self._deaf_until = False, 0.0
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
        os.close(self._far)

    def _run(self) -> None:
        self._poll.register(self._far, select.POLLIN)
        self._begun, self._cycles = time.monotonic(), self.avr.cycle
        while not self._over.wait(_TICK_S):
            with self.lock:
                self._catch_up()

    def _catch_up(self) -> None:
        (state,) = [event for _, event in self._poll.poll(0)] or [0]
        opened = not state & select.POLLHUP
        now = time.monotonic()
        if opened and not self.is_open:
            self.restarts += 1
            self.avr.reset()
            self._deaf_until = now + _DEAF_S
        self.is_open = opened
        if state & select.POLLIN:
            self.avr.rate(_RATES[termios.tcgetattr(self._far)[5]])
            with contextlib.suppress(OSError):
                data = os.read(self._far, 4096)
                if now >= self._deaf_until:
                    self.avr.receive(data)
        self.avr.run(self._cycles + round((now - self._begun) * self.avr.frequency))
        said = bytes(sent.value for sent in self.avr.take_sent())
        if opened and said:
            with contextlib.suppress(OSError):
                os.write(self._far, said)
