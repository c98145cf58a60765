"""Gathering facts about this computer: permissions, processes, disk."""

from __future__ import annotations

import os
import shutil
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from rig.doctor.facts import DiskFacts, Owner, PortFacts, SessionFacts
from rig.recover.examine import examine

if TYPE_CHECKING:
    from collections.abc import Iterator

_PROC = Path("/proc")
_UDEV = Path("/run/udev/data")
_IGNORED = ("E:ID_MM_DEVICE_IGNORE=1", "E:ID_MM_PORT_IGNORE=1")


def look_at_port(path: str, proc: Path = _PROC, udev: Path = _UDEV) -> PortFacts:
    """Gather what there is to know of a device path, without opening it.

    Parameters
    ----------
    path
        Of the device.
    proc, udev
        Where the kernel and udev keep their accounts.
    """
    place = Path(os.path.realpath(path))
    return PortFacts(
        path=path,
        exists=place.exists(),
        usable=os.access(place, os.R_OK | os.W_OK),
        group=_group(place),
        owners=tuple(_owners(place, proc)),
        modem_manager=any(name == "ModemManager" for _, name in _processes(proc)),
        left_alone=_left_alone(place, udev),
    )


def look_at_disk(folder: Path) -> DiskFacts:
    """Gather how much room there is in a folder, or where it will be made."""
    place = folder.absolute()
    while not place.exists():
        place = place.parent
    return DiskFacts(str(place), shutil.disk_usage(place).free)


def look_at_session(path: str) -> SessionFacts:
    """Gather what is whole of a session file."""
    found = examine(path)
    trouble = next(iter(found.troubles), "")
    return SessionFacts(path, found.whole, found.foreign, found.snapshot.writer, trouble)


def _group(place: Path) -> str:
    with suppress(OSError, KeyError):  # gone, or a group without a name
        return place.group()
    return ""


def _processes(proc: Path) -> Iterator[tuple[Path, str]]:
    for folder in proc.glob("[0-9]*"):
        with suppress(OSError):  # it has ended meanwhile
            yield folder, (folder / "comm").read_text("utf-8", "replace").strip()


def _owners(place: Path, proc: Path) -> Iterator[Owner]:
    """Find who has a port open; other users' processes do not tell."""
    for folder, name in _processes(proc):
        if folder.name == str(os.getpid()):
            continue
        with suppress(OSError):
            if any(_points_to(handle, place) for handle in (folder / "fd").iterdir()):
                words = (folder / "cmdline").read_bytes().split(b"\0")
                said = b" ".join(words).decode("utf-8", "replace").strip()
                yield Owner(int(folder.name), said or name)


def _points_to(handle: Path, place: Path) -> bool:
    with suppress(OSError):
        return str(handle.readlink()) == str(place)
    return False


def _left_alone(place: Path, udev: Path) -> bool:
    with suppress(OSError):
        number = place.stat().st_rdev
        account = udev / f"c{os.major(number)}:{os.minor(number)}"
        lines = account.read_text("utf-8", "replace").splitlines()
        return any(line in _IGNORED for line in lines)
    return False
