# SPDX-License-Identifier: GPL-3.0-or-later
"""A whole Pico in virtual time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from rig.errors import InputError
from rig_emulator.board import EmulatedBoard
from rig_emulator.pico_chip import PicoChip

if TYPE_CHECKING:
    from rig_emulator.controller import Controller
    from rig_emulator.image import Image
    from rig_emulator.wiring import Wiring

USB_RATE = 12_000_000
"""Bits a second on the bus. There is no other rate; packets take their time in the emulator."""


class EmulatedPico(EmulatedBoard):
    """See `EmulatedBoard`. Opening the port does not restart it."""

    avr: PicoChip

    def controller(
        self,
        wiring: Wiring,  # noqa: ARG002 - there is one only
        program: Path | Image,
        baudrate: int,  # noqa: ARG002 - USB knows none
        name: bytes,
    ) -> Controller:
        """Put the chip on the board, with the program in its flash."""
        if not isinstance(program, Path):
            raise InputError("a Pico is given a UF2 file")
        return PicoChip(program, name)

    def opened(self, at_ns: int, is_open: bool) -> None:
        """Open or close its port."""
        self.advance(at_ns)
        self.avr.open(is_open)
