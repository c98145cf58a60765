"""The boards that can be flashed: how, and what they call themselves."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple, TypeAlias

from rig.boards import MEGA, PICO, UNO, Capabilities
from rig.ready import find_resource

UNSEEN = "never seen on hardware: please tell us how it goes (docs/first-board.md)"
"""Said of every board until somebody has: then it becomes an attribute of `Target`."""

Say: TypeAlias = Callable[[str], None]
"""Tells whoever looks on what happens."""


class Target(NamedTuple):
    """A kind of board.

    Attributes
    ----------
    board
        The board.
    image
        File name of the firmware that comes with this program.
    flash_limit
        How much of its flash a firmware may take.
    avrdude
        The chip, and the boot loader's protocol and rate, as avrdude wants them; empty for a board
        that avrdude does not write.
    """

    board: Capabilities
    image: str
    flash_limit: int
    avrdude: str = ""

    @property
    def image_path(self) -> Path:
        """The firmware that comes with this program."""
        return Path(__file__).with_name(self.image)

    @property
    def wiring_path(self) -> Path:
        """The picture (SVG) of the circuits around it that comes with this program."""
        return find_resource(f"firmware/{self.image_path.stem}/wiring.svg")


TARGETS = {
    "pico": Target(PICO, "rp2040.uf2", 2 << 20),
    "mega": Target(MEGA, "atmega2560.hex", 0x3E000, "-p m2560 -c wiring -b 115200"),
    "uno": Target(UNO, "atmega328p.hex", 0x7E00, "-p m328p -c arduino -b 115200"),
    "nano-old": Target(UNO, "atmega328p.hex", 0x7800, "-p m328p -c arduino -b 57600"),
}
"""By the word for ``--board``. All boot loaders' rates are those of the makers' own tools. A
Nano is an Uno on a smaller board; those sold before 2018, and many since, have another loader."""
DRIVE = TARGETS["pico"]
"""The Pico, which shows a drive that its firmware is copied to."""
