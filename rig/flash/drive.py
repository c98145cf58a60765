"""A Pico that waits for firmware: the drive that it shows, and copying a file to it."""

import os
import re
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

from rig.errors import DeviceError
from rig.flash.boards import DRIVE, Say
from rig.flash.image import Image
from rig.link import messages as wire
from rig.link.client import Device
from rig.link.port import open_port, port_clock
from rig.reasons import rig_error
from rig.usb.listing import serial_ports

_ABOUT = "INFO_UF2.TXT"  # the boot program's file about the board
_BOARD = "RPI-RP2"
_LABEL = Path("/dev/disk/by-label") / _BOARD
_MOUNTS = Path("/proc/mounts")
_FAT = {"vfat", "msdos", "fuseblk"}
_OCTAL = re.compile(r"\\([0-7]{3})")
_BY_BUTTON = {"device_silent", "refused_unknown_message", "refused_version"}
"""Why a board has to be told by its button: it has another or an older firmware."""
_LOOK_S = 0.2
_MOUNT_S = 5.0
"""In which a desktop mounts the drive of a Pico that goes over to wait."""
_RESTART_S = 10.0
"""In which its port appears, and udev permits it, which it does some time after."""


def waiting_drives() -> list[Path]:
    """Find the drives of Picos that wait for firmware, where they are mounted."""
    text = _MOUNTS.read_text("utf-8", "surrogateescape") if _MOUNTS.exists() else ""
    mounts = [line.split(" ")[1:3] for line in text.splitlines()]
    names = [name for name, kind in mounts if kind in _FAT]
    folders = [Path(_OCTAL.sub(lambda code: chr(int(code[1], 8)), name)) for name in names]
    return [folder for folder in folders if _is_drive(folder)]


def sees_boot_pico() -> bool:
    """Whether a Pico in boot mode is plugged in, by the name that udev gives its drive."""
    return _LABEL.exists()


def pico_ports() -> set[str]:
    """List the ports of Picos with this project's firmware."""
    return {p.path for p in serial_ports() if p.candidate and DRIVE.board.name in p.kinds}


def copy_firmware(port: str | None, folder: str | None, image: Image, say: Say) -> str:
    """Copy firmware to a Pico's drive. It takes it block by block and restarts at the last.

    Parameters
    ----------
    port
        Device path that it will have; `None`: whichever appears.
    folder
        At which its drive is mounted; `None`: wherever it is, and a Pico that runs is asked first.
    image
        UF2 file.
    say
        Told what happens.

    Returns
    -------
    str
        The port of the board that has restarted.

    Raises
    ------
    InputError
        The folder that was given is no such drive.
    DeviceError
        No Pico waits, or several; it could not be written, or does not come back.
    """
    if folder is None and not waiting_drives() and not sees_boot_pico():
        _ask_to_wait(port, say)
    drive = _choose_drive(folder)
    before = pico_ports()
    say(f"copying {image.firmware} ({image.size} bytes) to the {DRIVE.board.name} at {drive}")
    try:
        with (drive / "chainrig.uf2").open("wb") as stream:
            stream.write(image.path.read_bytes())
            stream.flush()
            os.fsync(stream.fileno())
    except OSError as error:
        # The board may be gone before the computer has noticed that everything was written: who it
        # is afterwards decides.
        if _is_drive(drive):
            raise rig_error("drive_failed", path=drive, text=error) from None

    def restarted() -> list[str]:
        return [port] if port else [*pico_ports() - before]

    _wait(_RESTART_S, lambda: any(os.access(path, os.R_OK | os.W_OK) for path in restarted()))
    for path in restarted():
        return path
    raise rig_error("no_pico_port")


def _ask_to_wait(port: str | None, say: Say) -> None:
    """Ask the one Pico that runs to take firmware, which it does when it has nothing else to do."""
    paths = [port] if port else [*pico_ports()]
    if len(paths) != 1:
        return
    with closing(open_port(paths[0])) as opened:
        device = Device(opened, port_clock(opened))
        try:
            device.connect()
            device.request(wire.Flash(), wire.Done)
        except DeviceError as error:
            if not {reason.code for reason in error.reasons} <= _BY_BUTTON:
                raise
            return
    say(f"the {DRIVE.board.name} at {paths[0]} waits for firmware")
    _wait(_MOUNT_S, waiting_drives)


def _choose_drive(folder: str | None) -> Path:
    if folder is not None and not _is_drive(Path(folder)):
        raise rig_error("not_a_pico", path=folder, file=_ABOUT)
    drives = waiting_drives() if folder is None else [Path(folder)]
    if not drives:
        raise rig_error("pico_unmounted" if sees_boot_pico() else "no_pico")
    if len(drives) > 1:
        raise rig_error("many_picos", count=len(drives), names=", ".join(map(str, drives)))
    return drives[0]


def _wait(seconds: float, look: Callable[[], object]) -> None:
    """Look now and then, once at least, until there is something or the time is over."""
    end = time.monotonic() + seconds
    while not look() and time.monotonic() < end:
        time.sleep(_LOOK_S)


def _is_drive(folder: Path) -> bool:
    try:
        return _BOARD in (folder / _ABOUT).read_text("ascii", "replace")
    except OSError:
        return False
