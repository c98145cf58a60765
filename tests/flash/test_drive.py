"""``rig flash --board pico``: a folder for its drive, and a board that is there afterwards."""

from functools import partial
from itertools import count
from threading import Timer
from unittest.mock import Mock

import pytest

from rig.errors import InputError
from rig.flash import drive as drives
from rig.flash import steps
from rig.flash.boards import DRIVE, TARGETS
from rig.flash.image import read_image, shipped_firmware
from rig.link import messages as wire
from rig.reasons import rig_error
from sim.controller import Microcontroller
from tests.flash.pty_board import PtyBoard, info
from tests.refusals import refused
from tests.tables import cases

VERSION = shipped_firmware(DRIVE.board.name)
NAMES = {"board": DRIVE.board.name, "firmware": VERSION}


def picos(folder, monkeypatch, *names):
    """Mount drives of boards that wait for firmware, among other file systems."""
    waiting = [folder / name for name in names]
    for drive in waiting:
        drive.mkdir()
        about = "UF2 Bootloader v3.0\nModel: Raspberry Pi RP2\nBoard-ID: RPI-RP2\n"
        (drive / "INFO_UF2.TXT").write_text(about)
    (folder / "stick").mkdir()
    places = [folder / "stick", *waiting]
    escaped = (str(place).replace(" ", chr(92) + "040") for place in places)
    lines = ["proc /proc proc rw 0 0", *(f"/dev/sdb1 {place} vfat rw 0 0" for place in escaped)]
    (folder / "mounts").write_text("\n".join(lines) + "\n")
    monkeypatch.setattr(drives, "_MOUNTS", folder / "mounts")
    monkeypatch.setattr(drives, "_LABEL", folder / "label")
    return waiting


def plug_in(monkeypatch, path, is_in=lambda: True):
    """Have a Pico's port be there, while it is."""
    port = info(path, 0x2E8A, 0x000A, product="chainrig on a Pico")
    monkeypatch.setattr("serial.tools.list_ports.comports", lambda: [port] if is_in() else [])
    monkeypatch.setattr(drives, "_LOOK_S", 0.001)


def plugged(monkeypatch, path, after=1):
    """Have a Pico's port appear, at the look after so many."""
    looks = count()
    plug_in(monkeypatch, path, lambda: next(looks) >= after)


@pytest.fixture
def flash(flash):
    return partial(flash, board="pico")


def test_a_pico_is_flashed_and_asked(flash, tmp_path, monkeypatch):
    (drive,) = picos(tmp_path, monkeypatch, "RPI-RP2 of mine")
    with PtyBoard(**NAMES) as there:
        plugged(monkeypatch, there.path, after=3)
        done = flash()
    assert f"copying {VERSION} (" in done.err
    assert done.out.startswith(f"Raspberry Pi Pico, {VERSION}, 16 gates, id ")
    assert done.out.endswith(": flashed and verified\n")
    assert (drive / "chainrig.uf2").read_bytes() == DRIVE.image_path.read_bytes()


def running(monkeypatch, mounts, answer):
    """Have a running board answer FLASH; only when it is granted the drive is mounted."""
    mounted = mounts.read_text()
    mounts.write_text("")

    class Asked(Microcontroller):
        def answer(self, frame, now_ns):
            if frame.type != wire.CODES[wire.Flash]:
                return super().answer(frame, now_ns)
            if answer == wire.Done():
                Timer(0.05, mounts.write_text, [mounted]).start()
            return answer

    monkeypatch.setattr("sim.board.Microcontroller", Asked)


def test_a_running_pico_is_asked_to_take_firmware(flash, tmp_path, monkeypatch):
    (drive,) = picos(tmp_path, monkeypatch, "RPI-RP2")
    copy, mounts = drive / "chainrig.uf2", tmp_path / "mounts"
    running(monkeypatch, mounts, wire.Done())
    with PtyBoard(**NAMES) as there:
        plug_in(monkeypatch, there.path, lambda: not mounts.read_text() or copy.exists())
        done = flash()
    assert f"the Raspberry Pi Pico at {there.path} waits for firmware" in done.err
    assert done.out.endswith(": flashed and verified\n")
    assert copy.read_bytes() == DRIVE.image_path.read_bytes()


@cases
def test_a_running_pico_that_refuses_is_left_alone(flash, tmp_path, monkeypatch, reason, message):
    picos(tmp_path, monkeypatch, "RPI-RP2")
    running(monkeypatch, tmp_path / "mounts", wire.Refused(wire.RefusalReason[reason], 7))
    with PtyBoard(**NAMES) as there:
        plug_in(monkeypatch, there.path)
        done = flash(code=4)
    assert message in done.err


@cases
def test_what_keeps_a_pico_from_being_flashed_is_said(
    names, folder, messages, flash, tmp_path, monkeypatch
):
    waiting = picos(tmp_path, monkeypatch, *names)
    (tmp_path / folder).mkdir(exist_ok=True)
    monkeypatch.setattr(drives, "_RESTART_S", 0.0)
    plug_in(monkeypatch, "", lambda: False)
    done = flash(code=4)
    assert [message for message in messages if message not in done.err] == []
    assert len(names) < 2 or not any((drive / "chainrig.uf2").exists() for drive in waiting)


def test_the_ports_name_a_pico_that_nothing_has_mounted(tmp_path, monkeypatch, call):
    picos(tmp_path, monkeypatch)
    (tmp_path / "label").touch()
    monkeypatch.setattr("serial.tools.list_ports.comports", list)
    assert "drive RPI-RP2 is not mounted: " in call("ports").err


@pytest.mark.parametrize("port", [[], ["--port"]])
def test_a_port_that_udev_permits_a_little_later_is_waited_for(flash, tmp_path, monkeypatch, port):
    picos(tmp_path, monkeypatch, "RPI-RP2")
    refusals = iter([False] * 3)
    monkeypatch.setattr("os.access", lambda *_: next(refusals, True))
    with PtyBoard(**NAMES) as there:
        plugged(monkeypatch, there.path)
        flash(*port, *([there.path] if port else []))
    assert next(refusals, None) is None


def test_a_port_that_stays_forbidden_is_said(flash, tmp_path, monkeypatch):
    picos(tmp_path, monkeypatch, "RPI-RP2")
    refusal = rig_error("port_denied", port="/dev/ttyACM0", text="")
    monkeypatch.setattr(steps, "open_port", Mock(side_effect=refusal))
    monkeypatch.setattr("os.access", lambda *_: False)
    monkeypatch.setattr(drives, "_RESTART_S", 0.2)
    plugged(monkeypatch, "/dev/ttyACM0")
    assert "dialout" in flash(code=4).err


def test_what_is_no_such_drive_is_left_alone(flash, tmp_path):
    assert "is no drive of a Pico" in flash("--drive", tmp_path, code=2).err
    assert list(tmp_path.iterdir()) == []


@cases
def test_a_file_that_must_not_be_flashed(tmp_path, at, size, instead, message):
    data, file = DRIVE.image_path.read_bytes(), tmp_path / "it.uf2"
    at = data.index(at.encode()) if isinstance(at, str) else at
    file.write_bytes(data[:at] + instead.encode() + data[at + size :])
    refused(InputError, message, read_image, file, DRIVE)


def test_an_image_of_another_kind(tmp_path):
    mega = TARGETS["mega"]
    refused(InputError, "", read_image, mega.image_path, DRIVE)
    refused(InputError, "no whole record of an Intel HEX", read_image, DRIVE.image_path, mega)
