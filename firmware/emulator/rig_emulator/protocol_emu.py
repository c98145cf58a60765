# SPDX-License-Identifier: GPL-3.0-or-later
"""``emu://``: falling chains before the pins of an emulated board, as a pyserial port.

``emu://?protocol=FILE&seed=N&truth=FILE&board=mega&elf=FILE&<dial>=<value>…``: as ``sim://``, but
the answers come from the real firmware. ``board`` is ``mega``, ``uno`` or ``pico``; ``elf`` is
another firmware than the built one (for a Pico a UF2 file).
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from rig.errors import InputError
from rig.ports import read_settings
from rig_emulator.board import EmulatedBoard
from rig_emulator.pico_board import USB_RATE, EmulatedPico
from rig_emulator.pico_chip import need_pico
from rig_emulator.wiring import PICO, board_named, firmware_for
from sim.clock import VirtualClock
from sim.scene import set_scene
from sim.serial_port import SimulatedSerial

if TYPE_CHECKING:
    from rig_emulator.image import Image
    from rig_emulator.wiring import Wiring
    from sim.interfaces import Board
    from sim.scene import Scene

Made = TypeVar("Made", bound=EmulatedBoard)

_PATIENCE_NS = 10**9  # how far a read without a time-out looks ahead at once


class EmulatedSerial(SimulatedSerial):
    """A port with an emulated board behind it."""

    def open(self) -> None:
        """Open the port; an Arduino restarts, a Pico is told."""
        super().open()
        if isinstance(self.board, EmulatedPico):
            self.board.opened(self.clock.now_ns(), True)

    def close(self) -> None:
        """Close the port; a Pico is told."""
        if self.is_open and isinstance(self.board, EmulatedPico):
            self.board.opened(self.clock.now_ns(), False)
        super().close()

    def _reconfigure_port(self) -> None:
        """Take another rate, as the USB chip of 16 MHz makes it."""
        if isinstance(self.board, EmulatedBoard):
            self.board.avr.rate(16e6 / 8 / int(2e6 / self.baudrate))

    def upcoming(self, board: Board, end_ns: int | None) -> tuple[int | None, bool]:
        """Let the board run ahead of a read: as long as it lasts, the host sends nothing."""
        if not isinstance(board, EmulatedBoard):
            return super().upcoming(board, end_ns)
        until_ns = self.clock.now_ns() + _PATIENCE_NS if end_ns is None else end_ns
        arrival_ns = board.listen(until_ns)
        if arrival_ns is None:
            return (until_ns, False) if end_ns is None else (None, False)
        return arrival_ns, True


class Serial(EmulatedSerial):
    """The port that pyserial opens for an ``emu://`` URL."""

    def make_board(self) -> EmulatedBoard:
        """Hang the chains of the protocol that the URL names before the board it names."""
        settings = read_settings(str(self.port))
        wiring = board_named(settings.pop("board", "mega"))
        program = settings.pop("elf", "")
        if wiring is PICO:
            need_pico()
            self.reset_on_open = False
        scene = set_scene("emu", settings)
        self.clock = VirtualClock(scene.pace)
        self.disturb(scene.seed, scene.dials)
        return board_before(
            scene, wiring, Path(program) if program else firmware_for(wiring), self.baudrate
        )


def board_before(scene: Scene, wiring: Wiring, program: Path, baudrate: int) -> EmulatedBoard:
    """Put a board before a scene, see `put_before`."""
    if wiring is PICO:
        return put_before(scene, wiring, program, USB_RATE, EmulatedPico)
    return put_before(scene, wiring, program, baudrate, EmulatedBoard)


def put_before(
    scene: Scene, wiring: Wiring, program: Path | Image, baudrate: int, kind: type[Made]
) -> Made:
    """Put a board of some kind before a scene.

    Raises
    ------
    InputError
        When the scene has more gates than the board, or a clock that the emulator has not.
    """
    for gate in scene.lab.gates:
        if gate.channel >= len(wiring.gates):
            raise InputError(
                f"emu://: an {wiring.mcu} board has no gate {gate.channel}",
                f"its gates are 0 to {len(wiring.gates) - 1}",
            )
    dials = scene.dials
    if dials.drift or dials.wander:
        raise InputError("emu://: this clock is steady", "drift and wander are dials of sim://")
    ppm = dials.clock * 1e6
    board = kind(wiring, program, scene.lab, scene.seed, ppm=ppm, baudrate=baudrate)
    board.second_ns = scene.second_ns()
    return board
