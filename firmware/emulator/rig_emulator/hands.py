# SPDX-License-Identifier: GPL-3.0-or-later
"""The emulated board with hands around it and a log: ``python -m rig_emulator.hands``.

As `sim.pty` in everything, but the real program runs inside; what it keeps of a drop is read out
of its memory. ``--board`` names the board, ``--elf`` another firmware than the built one, and
``--loader`` puts Arduino's own boot loader before the program.
"""

from __future__ import annotations

import argparse
import struct
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from rig.link.messages import Phase
from rig_emulator.board import EmulatedBoard
from rig_emulator.bootloader import LOADERS, behind_loader
from rig_emulator.protocol_emu import put_before
from rig_emulator.wiring import BOARDS, board_named, firmware_for
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


def emulated(scene: Scene, options: argparse.Namespace) -> GlassBoard:
    """Put an emulated board before a scene."""
    wiring = board_named(options.board)
    program = options.elf or firmware_for(wiring)
    if options.loader:
        program = behind_loader(wiring.mcu, LOADERS[options.board], program)
    return put_before(scene, wiring, program, BAUDRATE, GlassBoard)


def start() -> int:
    """Run the command line; what is not said here `sim.pty` reads.

    Returns
    -------
    int
        Exit code.
    """
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument("--board", choices=sorted(BOARDS), default="mega")
    parser.add_argument("--elf", type=Path)
    parser.add_argument("--loader", action="store_true")
    options, rest = parser.parse_known_args()
    return main(rest, make=partial(emulated, options=options), scheme="emu")


if __name__ == "__main__":
    sys.exit(start())
