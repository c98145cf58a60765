"""Boards on USB: which ports are candidates, and the rule and units that open them."""

import configparser
import re
import runpy
import shutil
from pathlib import Path
from unittest.mock import Mock

import pytest

from rig.boards import PICO
from rig.cli import _parser
from rig.errors import DeviceError
from rig.flash.drive import pico_ports
from rig.usb.listing import KNOWN, Known, SerialPort, path_of, serial_number_at, serial_ports
from tests.flash.pty_board import PtyBoard, info
from tests.programs import run_program
from tests.refusals import refused
from tests.tables import cases, read_table

PACKAGING = Path(__file__).parents[2] / "packaging"


@pytest.fixture
def plugged(monkeypatch):
    def plug(*infos):
        monkeypatch.setattr("serial.tools.list_ports.comports", lambda: list(infos))

    plug(*(info(*port) for port in read_table(__file__, "ports")))
    return plug


@pytest.fixture
def never(monkeypatch):
    monkeypatch.setattr("rig.commands.ports.open_port", Mock(side_effect=AssertionError))


@cases
def test_candidates_come_first_and_the_others_say_why_not(candidate, lines, plugged, never, call):
    assert call("ports").out.splitlines() == lines
    first, *rest = call("ports", "--json").json["ports"]
    assert first == candidate
    assert not any(port["candidate"] for port in rest)
    plugged()
    done = call("ports")
    assert (done.out, "no board found" in done.err) == ("", True)


def test_only_candidates_are_asked_who_they_are(plugged, monkeypatch, call):
    busy = Mock(side_effect=DeviceError("it is busy", "close it"))
    monkeypatch.setattr("rig.commands.ports.open_port", busy)
    assert "it is busy" in call("ports", "--identify").out
    call("ports", "--identify", "/dev/ttyUSB0")
    assert [asked.args[0] for asked in busy.call_args_list] == ["/dev/ttyACM3", "/dev/ttyUSB0"]


def test_who_is_there_is_said_and_that_boards_share_an_id(plugged, call):
    with PtyBoard(board="Arduino Uno") as one, PtyBoard(board="Arduino Uno") as other:
        done = call("ports", "--identify", one.path, other.path)
    assert f"{other.path}  Arduino Uno, sim, id " in done.out.splitlines()[-1]
    assert re.search("several boards have the id [0-9a-f]{16}: erase", done.err)


def test_a_board_is_found_again_wherever_it_is_plugged_in(plugged, tmp_path):
    (link := tmp_path / "by-id").symlink_to("/dev/ttyACM3")
    places = "/dev/ttyACM3", str(link), "/dev/ttyUSB0", "sim://"
    assert [*map(serial_number_at, places)] == ["85430", "85430", None, None]
    other = info("/dev/ttyACM3", 0x2341, 0x43, "other")
    plugged(other)
    assert path_of("85430", serial_ports()) is None
    plugged(other, info("/dev/ttyACM9", 1, 2, "85430"))
    assert path_of("85430", serial_ports()) == "/dev/ttyACM9"


def test_a_pico_with_another_program_is_not_opened(plugged):
    numbers = 0x2E8A, 0x000A
    plugged(
        info("/dev/ttyACM0", *numbers, product="MicroPython"),
        info("/dev/ttyACM1", *numbers),
        info("/dev/ttyACM2", *numbers, product="chainrig on a Pico"),
    )
    ports = serial_ports()
    assert [(port.path, port.candidate) for port in ports] == [
        *(("/dev/ttyACM2", True), ("/dev/ttyACM0", False), ("/dev/ttyACM1", False))
    ]
    assert "another program" in ports[1].skipped
    assert pico_ports() == {"/dev/ttyACM2"}


def test_copies_that_share_a_number_are_not_confused(plugged):
    plugged(info("/dev/ttyUSB0", serial_number="0001"), info("/dev/ttyUSB1", serial_number="0001"))
    said = "/dev/ttyUSB0 and /dev/ttyUSB1 have the same"
    refused(DeviceError, said, path_of, "0001", serial_ports())


@pytest.mark.parametrize("first", KNOWN, ids=lambda kind: kind.name)
def test_a_second_board_may_have_the_same_chip(plugged, monkeypatch, first):
    """Once either may be there, the port is a board's."""
    other = Known("Teensy 9", first.numbers[:9], "")
    monkeypatch.setattr("rig.usb.listing.KNOWN", (*KNOWN, other))
    plugged(info("/dev/ttyACM0", *(int(part, 16) for part in first.numbers[:9].split(":"))))
    (port,) = serial_ports()
    assert (port.kind, port.candidate) == (f"{first.name} or Teensy 9", True)
    assert pico_ports() == ({port.path} if first.name == PICO.name else set())


def test_the_udev_rule_opens_every_kind_and_hides_boards_from_modem_manager(capsys):
    runpy.run_module("rig.usb.udev", run_name="__main__")
    rule = capsys.readouterr().out
    assert rule == (PACKAGING / "60-chainrig.rules").read_text("ascii")
    for kind in KNOWN:
        for vid, pid in (pair.split(":") for pair in kind.numbers.split()):
            match = f'ATTRS{{idVendor}}=="{vid}", ATTRS{{idProduct}}=="{pid}", '
            assert (
                f'SUBSYSTEM=="tty", {match}GROUP="dialout", MODE="0660", TAG+="uaccess"\n' in rule
            )
            assert (f"\n{match}ENV" in rule) == (kind.product is not None)


IS_HERE = bool(shutil.which("systemd-analyze"))


def complaints_of(unit):
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
    assert _parser().parse_args(arguments).place == "daemon.main"


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
def test_the_unit_starts_a_daemon_at_the_board(units, call, words, service, command):
    done = call("service", "install", *words)
    (unit,) = units.iterdir()
    assert unit.name == f"{service}.service"
    text = unit.read_text()
    (line,) = [line for line in text.splitlines() if line.startswith("ExecStart=")]
    assert f" {command} $RIG_OPTIONS" in line
    assert "EnvironmentFile=-" in text
    assert f"enable --now {service}\n" in done.err
    if IS_HERE:
        assert complaints_of(unit) == []


def test_a_port_is_named_so_that_it_stays(units, tmp_path, monkeypatch, call):
    link, device = tmp_path / "usb-Pico", tmp_path / "ttyACM0"
    link.symlink_to(device)
    monkeypatch.setattr(
        "rig.commands.service_install.Path",
        lambda path: tmp_path if "by-id" in path else Path(path),
    )
    assert f".service: {link}\n" in call("service", "install", "--port", device).err


def test_without_a_board_there_is_no_unit(units, monkeypatch, call):
    monkeypatch.setattr("rig.usb.listing.serial_ports", list)
    assert "no board found" in call("service", "install", code=4).err
    assert not units.exists()
