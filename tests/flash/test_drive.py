"""``rig flash --board pico``: a folder for its drive, and a board that is there afterwards."""

from collections.abc import Callable
from functools import partial
from itertools import count
from pathlib import Path
from unittest.mock import Mock

import pytest
from serial.tools.list_ports_common import ListPortInfo

from rig.cli import main
from rig.errors import DeviceError, InputError
from rig.flash import drive as drives
from rig.flash import steps
from rig.flash.boards import DRIVE, TARGETS
from rig.flash.image import read_image, shipped_firmware
from rig.link import messages as wire
from rig.link.messages import RefusalReason
from rig.link.port import open_port
from rig.reasons import make_error
from sim.controller import Microcontroller
from tests.flash.pty_board import PtyBoard

VERSION = shipped_firmware(DRIVE.board.name)
NAMES = {"board": DRIVE.board.name, "firmware": VERSION}


def picos(folder: Path, monkeypatch, *names: str) -> list[Path]:
    """Mount drives of boards that wait for firmware, among other file systems."""
    made = []
    for name in names:
        (drive := folder / name).mkdir()
        (drive / "INFO_UF2.TXT").write_text("UF2 Bootloader v3.0\nModel: Raspberry Pi RP2\n"
                                            "Board-ID: RPI-RP2\n")  # fmt: skip
        made.append(drive)
    (folder / "stick").mkdir()
    lines = ["proc /proc proc rw 0 0", f"/dev/sdb1 {folder}/stick vfat rw 0 0"]
    lines += [f"/dev/sdc1 {str(one).replace(' ', chr(92) + '040')} vfat rw 0 0" for one in made]
    (mounts := folder / "mounts").write_text("\n".join(lines) + "\n")
    monkeypatch.setattr(drives, "_MOUNTS", mounts)
    (folder / "usb").mkdir()
    monkeypatch.setattr(drives, "_USB", folder / "usb")
    return made


def plug_in(monkeypatch, path: str, is_in: Callable[[], bool] = lambda: True) -> None:
    """Have a Pico's port be there, while it is."""
    info = ListPortInfo(path)
    info.vid, info.pid, info.product = 0x2E8A, 0x000A, "chainrig on a Pico"
    monkeypatch.setattr("serial.tools.list_ports.comports", lambda: [info] if is_in() else [])
    monkeypatch.setattr(drives, "_LOOK_S", 0.001)


def plugged(monkeypatch, path: str, after: int = 1) -> None:
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
        code, out, err = flash()
    assert code == 0, err
    assert out.startswith(f"Raspberry Pi Pico, {VERSION}, 16 gates, id ")
    assert out.endswith(": flashed and verified\n")
    assert (drive / "chainrig.uf2").read_bytes() == DRIVE.shipped.read_bytes()


def running(monkeypatch, mounts: Path, answer: wire.DeviceMessage) -> None:
    """Have a running board answer FLASH; only when it is granted the drive is mounted."""
    mounted = mounts.read_text()
    mounts.write_text("")

    class Asked(Microcontroller):
        def answer(self, frame, now_ns):
            if frame.type != wire.CODES[wire.Flash]:
                return super().answer(frame, now_ns)
            mounts.write_text(mounted if answer == wire.Done() else "")
            return answer

    monkeypatch.setattr("sim.board.Microcontroller", Asked)


def test_a_running_pico_is_asked_to_take_firmware(flash, tmp_path, monkeypatch):
    (drive,) = picos(tmp_path, monkeypatch, "RPI-RP2")
    copy, mounts = drive / "chainrig.uf2", tmp_path / "mounts"
    running(monkeypatch, mounts, wire.Done())
    with PtyBoard(**NAMES) as there:
        plug_in(monkeypatch, there.path, lambda: not mounts.read_text() or copy.exists())
        code, out, err = flash()
    assert code == 0, err
    assert out.endswith(": flashed and verified\n")
    assert copy.read_bytes() == DRIVE.shipped.read_bytes()


@pytest.mark.parametrize(
    ("reason", "message"),
    [
        (RefusalReason.HOLDING_A_DROP, "the device still holds the drop of run 7"),
        (RefusalReason.BUSY, "the device is busy with a drop"),
        (RefusalReason.UNKNOWN_MESSAGE, "hold its BOOTSEL button"),
    ],
)
def test_a_running_pico_that_refuses_is_left_alone(flash, tmp_path, monkeypatch, reason, message):
    picos(tmp_path, monkeypatch, "RPI-RP2")
    running(monkeypatch, tmp_path / "mounts", wire.Refused(reason, 7))
    with PtyBoard(**NAMES) as there:
        plug_in(monkeypatch, there.path)
        code, out, err = flash()
    assert (code, out) == (4, "")
    assert message in err


def test_no_drive_says_how_to_make_it_appear(flash, tmp_path, monkeypatch):
    picos(tmp_path, monkeypatch)
    code, out, err = flash()
    assert (code, out) == (4, "")
    assert "no Pico waits for firmware" in err
    assert "hold its BOOTSEL button" in err


def test_a_pico_in_boot_mode_that_nothing_has_mounted_is_said(flash, tmp_path, monkeypatch, capsys):
    picos(tmp_path, monkeypatch)
    for name, product in (("1-1", "0042"), ("1-2", "0003")):
        (device := tmp_path / "usb" / name).mkdir()
        (device / "idVendor").write_text("2e8a\n")
        (device / "idProduct").write_text(f"{product}\n")
    code, out, err = flash()
    assert (code, out) == (4, "")
    assert "a Pico waits for firmware, but its drive RPI-RP2 is not mounted" in err
    assert "/dev/disk/by-label/RPI-RP2" in err
    monkeypatch.setattr("serial.tools.list_ports.comports", list)
    assert main(["ports"]) == 0
    assert "drive RPI-RP2 is not mounted: " in capsys.readouterr().err


def test_a_port_that_udev_permits_a_little_later_is_waited_for(flash, tmp_path, monkeypatch):
    picos(tmp_path, monkeypatch, "RPI-RP2")
    refusals = iter([make_error(DeviceError, "port_denied", port="x", text="")] * 3)

    def open_later(port):
        for refusal in refusals:
            raise refusal
        return open_port(port)

    monkeypatch.setattr(steps, "open_port", open_later)
    with PtyBoard(**NAMES) as there:
        plugged(monkeypatch, there.path)
        code, _, err = flash()
    assert code == 0, err


def test_a_port_that_stays_forbidden_is_said(flash, tmp_path, monkeypatch):
    picos(tmp_path, monkeypatch, "RPI-RP2")
    refusal = make_error(DeviceError, "port_denied", port="/dev/ttyACM0", text="")
    monkeypatch.setattr(steps, "open_port", Mock(side_effect=refusal))
    monkeypatch.setattr(steps, "_UDEV_S", 0.2)
    plugged(monkeypatch, "/dev/ttyACM0")
    code, _, err = flash()
    assert code == 4
    assert "dialout" in err


def test_what_is_no_such_drive_is_left_alone(flash, tmp_path):
    code, _, err = flash("--drive", tmp_path)
    assert code == 2
    assert "is no drive of a Pico" in err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["flash", "--board", "mega"], "--port is missing"),
        (["flash", "--board", "mega", "--drive", "x"], "--drive is for a Raspberry Pi Pico"),
        (["flash", "--board", "pico", "--avrdude", "x"], "--avrdude does not write"),
    ],
)
def test_options_of_the_other_boards(capsys, arguments, message):
    assert main(arguments) == 2
    assert message in capsys.readouterr().err


def _with(at: int, value: bytes, size: int = 4):
    return lambda data: data[:at] + value + data[at + size :]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (_with(0, b"", 1), "no whole UF2 file"),
        (lambda _: b"", "no whole UF2 file"),
        (_with(512, b"", 512), "not whole: block 0"),
        (_with(512 + 12, bytes(4)), "not whole: block 1"),
        (_with(28, bytes(4)), "not for an RP2040"),
        (_with(0, b"X", 1), "no UF2 file, or damaged: block 0"),
        (lambda data: data.replace(b"Raspberry Pi Pico\0", b"Raspberry Pi Pika\0"), "no firmware"),
    ],
)
def test_a_file_that_must_not_be_flashed(tmp_path, change, message):
    (file := tmp_path / "it.uf2").write_bytes(change(DRIVE.shipped.read_bytes()))
    with pytest.raises(InputError, match=message):
        read_image(file, DRIVE)


def test_an_image_of_another_kind(tmp_path):
    with pytest.raises(InputError):
        read_image(TARGETS["mega"].shipped, DRIVE)
    with pytest.raises(InputError, match="no record of an Intel HEX file"):
        read_image(DRIVE.shipped, TARGETS["mega"])
