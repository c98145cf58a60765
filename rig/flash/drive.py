"""A Pico that waits for firmware: the drive that it shows, and copying a file to it."""

from __future__ import annotations

import os
import re
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from rig.errors import DeviceError, DeviceTimeoutError, InputError
from rig.flash.boards import DRIVE
from rig.reasons import make_error
from rig.usb.listing import serial_ports

_MOUNTS = Path("/proc/mounts")
_ABOUT = "INFO_UF2.TXT"  # the boot program's file about the board
_BOARD = "RPI-RP2"
_USB = Path("/sys/bus/usb/devices")
_BOOT = ["2e8a", "0003"]  # USB vendor and product of the RP2040's boot program
_OCTAL = re.compile(r"\\([0-7]{3})")
_LOOK_S = 0.2
MOUNT_S = 5.0
"""In which a desktop mounts the drive of a Pico that goes over to wait."""
_RESTART_S = 10.0


def waiting_drives() -> list[Path]:
    """Find the drives of Picos that wait for firmware, where they are mounted."""
    return [folder for folder in _fat_mounts() if _is_drive(folder)]


def sees_boot_pico() -> bool:
    """Whether a Pico in boot mode is plugged in, by the kernel's account of USB devices."""
    names = ("idVendor", "idProduct")
    for device in _USB.glob("*"):
        with suppress(OSError):
            if [(device / name).read_text("ascii").strip() for name in names] == _BOOT:
                return True
    return False


def looks(seconds: float) -> Iterator[None]:
    """Come back now and then until the time is over, and once at least."""
    end = time.monotonic() + seconds
    yield
    while time.monotonic() < end:
        time.sleep(_LOOK_S)
        yield


def choose_drive(folder: str | None) -> Path:
    """Find the one drive to copy to.

    Raises
    ------
    InputError
        The folder that was given is no such drive.
    DeviceError
        There is none, or several.
    """
    if folder is not None:
        if not _is_drive(Path(folder)):
            raise make_error(InputError, "not_a_pico", path=folder, file=_ABOUT)
        return Path(folder)
    drives = waiting_drives()
    if len(drives) == 1:
        return drives[0]
    if drives:
        names = ", ".join(map(str, drives))
        raise make_error(DeviceError, "many_picos", count=len(drives), names=names)
    raise make_error(DeviceError, "pico_unmounted" if sees_boot_pico() else "no_pico")


def copy_to(drive: Path, image: Path) -> None:
    """Copy a file. The board takes it block by block and restarts at the last: the drive is gone.

    Raises
    ------
    DeviceError
        The drive could not be written.
    """
    code = "drive_unwritable"
    try:
        with (drive / "chainrig.uf2").open("wb") as stream:
            code = "drive_failed"
            stream.write(image.read_bytes())
            stream.flush()
            os.fsync(stream.fileno())
    except OSError as error:
        # The board may be gone before the computer has noticed that everything was written: who it
        # is afterwards decides.
        if code == "drive_unwritable" or _is_drive(drive):
            raise make_error(DeviceError, code, path=drive, text=error) from None


def new_port(before: set[str]) -> str:
    """Wait for the port of the board that restarts.

    Parameters
    ----------
    before
        Ports that were there already.

    Raises
    ------
    DeviceTimeoutError
        None appears.
    """
    for _ in looks(_RESTART_S):
        for path in pico_ports() - before:
            return path
    raise make_error(DeviceTimeoutError, "no_pico_port")


def pico_ports() -> set[str]:
    """List the ports of Picos with this project's firmware."""
    return {p.path for p in serial_ports() if p.candidate and DRIVE.board.name in p.kinds}


def _fat_mounts() -> Iterator[Path]:
    try:
        lines = _MOUNTS.read_text("utf-8", "surrogateescape").splitlines()
    except OSError:  # another kernel
        return
    for line in lines:
        _, folder, kind, *_ = line.split(" ")
        if kind in {"vfat", "msdos", "fuseblk"}:
            yield Path(_OCTAL.sub(lambda code: chr(int(code[1], 8)), folder))


def _is_drive(folder: Path) -> bool:
    try:
        return _BOARD in (folder / _ABOUT).read_text("ascii", "replace")
    except OSError:
        return False
