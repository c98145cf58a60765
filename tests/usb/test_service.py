"""The units that are shipped for systemd."""

import configparser
from pathlib import Path

import pytest

from rig.cli import _parser
from tests.usb.systemd import IS_HERE, complaints_of

ROOT = Path(__file__).parents[2]
UNITS = pytest.mark.parametrize(
    "unit", [*(ROOT / "packaging").glob("*.service")], ids=lambda unit: unit.stem
)


@UNITS
def test_it_starts_a_command_that_there_is(unit):
    settings = configparser.ConfigParser(interpolation=None)
    settings.optionxform = str
    settings.read(unit)
    words = settings["Service"]["ExecStart"].split()
    rig = words.index("rig")
    arguments = [word.replace("%i", "left") for word in words[rig + 1 :] if word != "$RIG_OPTIONS"]
    assert _parser().parse_args(arguments).place == "daemon.main"


@pytest.mark.skipif(not IS_HERE, reason="needs systemd-analyze")
@UNITS
def test_systemd_understands_it(unit):
    assert complaints_of(unit) == []
