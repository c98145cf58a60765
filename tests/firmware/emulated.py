"""The emulator, or the reason why there is none: import this before `rig_emulator`."""

import os

import pytest

try:
    import rig_emulator.avr  # noqa: F401
except ImportError as error:
    if os.environ.get("CI"):
        raise
    pytest.skip(
        f"the emulator is not installed ({error}): pip install ./firmware/emulator",
        allow_module_level=True,
    )


MCUS = ("atmega2560", "atmega328p")
