"""A Pico that waits for firmware: the drive that it shows, and copying a file to it."""

from __future__ import annotations

import os
import re
import time
from pathlib import Path
from typing import TYPE_CHECKING

from rig.errors import DeviceError, DeviceTimeoutError, InputError
from rig.flash.boards import DRIVE
from rig.usb.listing import serial_ports

if TYPE_CHECKING:
    from collections.abc import Iterator

_MOUNTS = Path("/proc/mounts")
_ABOUT = "INFO_UF2.TXT"  # the boot program's file about the board
_BOARD = "RPI-RP2"
_HOW = (
    f"hold its BOOTSEL button while you put in the plug: a drive {_BOARD} appears; "
    "if nothing mounts it by itself, mount it and say --drive FOLDER"
)
_OCTAL = re.compile(r"\\([0-7]{3})")
_LOOK_S = 0.2


def waiting_drives(mounts: Path = _MOUNTS) -> list[Path]:
    """Find the drives of Picos that wait for firmware, where they are mounted.

    Parameters
    ----------
    mounts
        The kernel's account of what is mounted.
    """
    return [folder for folder in _mounted(mounts) if _is_drive(folder)]


def choose_drive(given: str | None, mounts: Path = _MOUNTS) -> Path:
    """Find the one drive to copy to.

    Raises
    ------
    InputError
        The folder that was given is no such drive.
    DeviceError
        There is none, or several.
    """
    if given is not None:
        if not _is_drive(Path(given)):
            raise InputError(f"{given} is no drive of a Pico: it has no {_ABOUT} of one", _HOW)
        return Path(given)
    found = waiting_drives(mounts)
    if not found:
        raise DeviceError("no Pico waits for firmware", _HOW)
    if len(found) > 1:
        raise DeviceError(
            f"{len(found)} Picos wait for firmware: {', '.join(map(str, found))}",
            "choose one with --drive FOLDER",
        )
    return found[0]


def copy_to(drive: Path, image: Path) -> None:
    """Copy a file. The board takes it block by block and restarts at the last: the drive is gone.

    Raises
    ------
    DeviceError
        The drive could not be written.
    """
    data = image.read_bytes()
    try:
        file = os.open(drive / "chainrig.uf2", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    except OSError as error:
        raise DeviceError(f"cannot write to {drive}: {error.strerror}", _HOW) from None
    try:
        written = 0
        while written < len(data):
            written += os.write(file, data[written:])
        os.fsync(file)
        os.close(file)
    except OSError as error:
        # The board may be gone before the computer has noticed that everything was written: who it
        # is afterwards decides.
        if _is_drive(drive):
            raise DeviceError(f"writing to {drive} failed: {error.strerror}", _HOW) from None


def new_port(before: set[str], patience_s: float = 10.0) -> str:
    """Wait for the port of the board that restarts.

    Parameters
    ----------
    before
        Ports that were there already.
    patience_s
        How long, s.

    Raises
    ------
    DeviceTimeoutError
        None appears.
    """
    end = time.monotonic() + patience_s
    while True:
        for path in pico_ports() - before:
            return path
        if time.monotonic() > end:
            raise DeviceTimeoutError(
                "the firmware was copied, but no port of a Pico appears",
                "pull its plug and put it in again, then rig ports",
            )
        time.sleep(_LOOK_S)


def pico_ports() -> set[str]:
    """List the ports that are a Pico's by their numbers."""
    return {port.path for port in serial_ports() if DRIVE.board.name in port.kinds}


def _mounted(mounts: Path) -> Iterator[Path]:
    try:
        lines = mounts.read_text("utf-8", "surrogateescape").splitlines()
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
