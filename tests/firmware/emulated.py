"""The emulator, or the reason why there is none: import this before `rig_emulator`."""

from __future__ import annotations

import os

import pytest

from tests.firmware.toolchain import FIRMWARE

try:
    import rig_emulator.avr  # noqa: F401
except ImportError as error:
    if os.environ.get("CI"):
        raise
    pytest.skip(
        f"the emulator is not installed ({error}): pip install ./firmware/emulator",
        allow_module_level=True,
    )

EMULATOR = FIRMWARE / "emulator"
MCUS = ("atmega2560", "atmega328p")
