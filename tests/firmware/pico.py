"""The Pico's image and its emulator, or the reason why there is none."""

import os

import pytest

from rig.errors import InputError
from rig_emulator.pico_chip import need_pico
from tests.firmware.toolchain import FIRMWARE, make, need
from tests.programs import run_program

FOLDER = FIRMWARE / "build" / "rp2040"


def build():
    """Build the image, and see that there is an emulator for it."""
    need("arm-none-eabi-gcc", "node")
    try:
        need_pico()
    except InputError as error:
        if os.environ.get("CI"):
            raise
        pytest.skip(str(error))
    make("pico")
    return FOLDER / "firmware.uf2"


def symbol(name):
    """Say where a variable of the firmware is."""
    table = run_program("arm-none-eabi-nm", FOLDER / "firmware.elf").stdout
    return next(
        int(line.split()[0], 16) for line in table.splitlines() if line.endswith(f" {name}")
    )
