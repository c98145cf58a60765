"""The boards that can be flashed: how, and what they call themselves."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from rig.boards import MEGA, PICO, UNO, Capabilities

UNSEEN = "never seen on hardware: please tell us how it goes (docs/first-board.md)"
"""Said of every board until somebody has: then it becomes an attribute of `Target`."""
FIRMWARE = "chainrig"
"""What a firmware of this project begins its name with; its version follows."""


@dataclass(frozen=True, slots=True)
class Target:
    """A kind of board.

    Attributes
    ----------
    board
        The board.
    image
        File name of the firmware that comes with this program.
    flash_limit
        How much of its flash a firmware may take.
    """

    board: Capabilities
    image: str
    flash_limit: int

    @property
    def shipped(self) -> Path:
        """The firmware that comes with this program."""
        return Path(__file__).with_name(self.image)


@dataclass(frozen=True, slots=True)
class AvrTarget(Target):
    """A board that avrdude writes.

    Attributes
    ----------
    part, programmer, baudrate
        The chip and the boot loader's protocol and rate, as avrdude wants them.
    """

    part: str
    programmer: str
    baudrate: int


TARGETS = {
    "mega": AvrTarget(MEGA, "atmega2560.hex", 0x3E000, "m2560", "wiring", 115200),
    "uno": AvrTarget(UNO, "atmega328p.hex", 0x7E00, "m328p", "arduino", 115200),
    "nano-old": AvrTarget(UNO, "atmega328p.hex", 0x7800, "m328p", "arduino", 57600),
}
"""By the word for ``--board``. All boot loaders' rates are those of the makers' own tools. A
Nano is an Uno on a smaller board; those sold before 2018, and many since, have another loader."""

DRIVE = Target(PICO, "rp2040.uf2", 2 << 20)
"""The Pico, which shows a drive that its firmware is copied to."""
