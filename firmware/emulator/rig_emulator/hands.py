# SPDX-License-Identifier: GPL-3.0-or-later
"""The emulated board with hands around it and a log: ``python -m rig_emulator.hands``.

As `sim.pty` in everything, but the real program runs inside; what it keeps of a drop is read out
of its memory. ``--loader`` before all else puts Arduino's own boot loader before the program.
"""

from __future__ import annotations

import struct
import sys
from typing import TYPE_CHECKING

from rig.link.messages import Phase
from rig_emulator.board import EmulatedBoard
from rig_emulator.bootloader import LOADERS, behind_loader
from rig_emulator.protocol_emu import put_before
from rig_emulator.wiring import board_named, firmware_for
from sim.pty import main

if TYPE_CHECKING:
    from rig_emulator.avr import Avr
    from sim.scene import Scene

BAUDRATE = 500_000
_DROP = struct.Struct("<4I3H")  # struct drop in firmware/core/drop.h, as far as it is told
_EVENT = struct.Struct("<IH")  # in firmware/core/events.h


class GlassBoard(EmulatedBoard):
    """An emulated board that can be looked into."""

    avr: Avr

    def phase(self) -> int:
        """Tell what it is doing, see `rig.link.messages.Phase`."""
        return self.avr.number("phase") if self.runs else Phase.IDLE

    def held(self) -> tuple[dict[str, int], list[tuple[int, int]]]:
        """Tell what it keeps of the drop it holds: the certificate's main fields, the events."""
        label, fire_tick, _, crc32, _, events, overflows = _DROP.unpack_from(self.avr.peek("drop"))
        memory = self.avr.peek("events_memory")[: events * _EVENT.size]
        told = {"label": label, "fire_tick": fire_tick, "events": events, "crc32": crc32}
        return told | {"overflows": overflows}, list(_EVENT.iter_unpack(memory))


def emulated(scene: Scene) -> GlassBoard:
    """Put an emulated Mega before a scene."""
    wiring = board_named("mega")
    return put_before(scene, wiring, firmware_for(wiring), BAUDRATE, GlassBoard)


def bought(scene: Scene) -> GlassBoard:
    """Put one with Arduino's own boot loader before it."""
    wiring = board_named("mega")
    program = behind_loader(wiring.mcu, LOADERS["mega"], firmware_for(wiring))
    return put_before(scene, wiring, program, BAUDRATE, GlassBoard)


if __name__ == "__main__":
    first, *others = sys.argv[1:]
    if first == "--loader":
        sys.exit(main(others, make=bought, scheme="emu"))
    sys.exit(main(make=emulated, scheme="emu"))
