"""The units for systemd: those that are shipped, and the one that rig service install writes."""

import configparser
import shutil
from pathlib import Path

import pytest

from rig.cli import _parser, main
from rig.usb.listing import SerialPort
from tests.programs import run_program
from tests.tables import cases

IS_HERE = bool(shutil.which("systemd-analyze"))


def complaints_of(unit: Path) -> list[str]:
    """Lines that name the unit."""
    done = run_program("systemd-analyze", "verify", unit, code=None)
    return [line for line in done.stderr.splitlines() if unit.name in line]


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
    assert _parser().parse_args(arguments).module == "daemon"


@pytest.mark.skipif(not IS_HERE, reason="needs systemd-analyze")
@UNITS
def test_systemd_understands_it(unit):
    assert complaints_of(unit) == []


@pytest.fixture
def units(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    boards = [SerialPort("/dev/ttyACM0"), SerialPort("/dev/ttyS0", skipped="no USB device")]
    monkeypatch.setattr("rig.usb.listing.serial_ports", lambda: boards)
    return tmp_path / "systemd/user"


@cases
def test_the_unit_starts_a_daemon_at_the_board(units, capsys, words, service, command):
    assert main(["service", "install", *words]) == 0
    (unit,) = units.iterdir()
    assert unit.name == f"{service}.service"
    text = unit.read_text()
    (line,) = [line for line in text.splitlines() if line.startswith("ExecStart=")]
    assert f" {command} $RIG_OPTIONS" in line
    assert "EnvironmentFile=-" in text
    assert f"enable --now {service}\n" in capsys.readouterr().err
    if IS_HERE:
        assert complaints_of(unit) == []


def test_a_port_is_named_so_that_it_stays(units, tmp_path, monkeypatch, capsys):
    link, device = tmp_path / "usb-Pico", tmp_path / "ttyACM0"
    link.symlink_to(device)
    monkeypatch.setattr(
        "rig.commands.service_install.Path",
        lambda path: tmp_path if "by-id" in path else Path(path),
    )
    assert main(["service", "install", "--port", str(device)]) == 0
    assert f".service: {link}\n" in capsys.readouterr().err


def test_without_a_board_there_is_no_unit(units, monkeypatch, capsys):
    monkeypatch.setattr("rig.usb.listing.serial_ports", list)
    assert main(["service", "install"]) == 4
    assert "no board found" in capsys.readouterr().err
    assert not units.exists()
