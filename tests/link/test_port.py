"""What opening a port says when it cannot."""

import sys

import pytest

from rig.errors import DeviceError
from rig.link.port import open_port


def test_a_missing_emulator_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "rig_emulator", None)  # importing it now fails
    with pytest.raises(DeviceError, match="emulator is not installed") as caught:
        open_port("emu://?protocol=x.yaml")
    assert "./firmware/emulator" in caught.value.hint
    assert "libsimavr-dev" in caught.value.hint
