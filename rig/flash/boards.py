"""The boards that can be flashed: how avrdude calls them, and what they call themselves."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from rig.boards import MEGA, UNO, Capabilities

FIRMWARE = "chainrig"
"""What a firmware of this project begins its name with; its version follows."""


@dataclass(frozen=True, slots=True)
class Target:
    """A kind of board.

    Attributes
    ----------
    board
        The board.
    part, programmer, baudrate
        The chip and the boot loader's protocol and rate, as avrdude wants them.
    image
        File name of the firmware that comes with this program.
    flash_limit
        First address that belongs to the boot loader.
    """

    board: Capabilities
    part: str
    programmer: str
    baudrate: int
    image: str
    flash_limit: int

    @property
    def shipped(self) -> Path:
        """The firmware that comes with this program."""
        return Path(__file__).with_name(self.image)


TARGETS = {
    "mega": Target(MEGA, "m2560", "wiring", 115200, "atmega2560.hex", 0x3E000),
    "uno": Target(UNO, "m328p", "arduino", 115200, "atmega328p.hex", 0x7E00),
    "nano-old": Target(UNO, "m328p", "arduino", 57600, "atmega328p.hex", 0x7800),
}
"""By the word for ``--board``. All boot loaders' rates are those of the makers' own tools. A
Nano is an Uno on a smaller board; those sold before 2018, and many since, have another loader."""
