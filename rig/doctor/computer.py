"""Checks of this computer: who may and does use a port, other packages, disk and kept results.

A check returns what is well, in words, or raises why it is not. No port is opened.
"""

from __future__ import annotations

import os
import shutil
from contextlib import suppress
from importlib.metadata import packages_distributions
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from rig.selftest.findings import CheckFailedError, fail_if

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rig.cache.store import CacheFile

ROOM = 200 * 10**6
"""Bytes that should be free: a day of drops takes a few tens of MB, and its log as much again."""
_IGNORED = ("E:ID_MM_DEVICE_IGNORE=1", "E:ID_MM_PORT_IGNORE=1")


class PortPlace(NamedTuple):
    """A port's path, and where the kernel and udev keep their accounts."""

    path: str
    proc: Path = Path("/proc")
    udev: Path = Path("/run/udev/data")

    @property
    def device(self) -> Path:
        """What the path leads to."""
        return Path(os.path.realpath(self.path))


def check_permission(port: PortPlace) -> str:
    """See that this user may read and write the port."""
    fail_if(not port.device.exists(), "port_missing")
    if os.access(port.device, os.R_OK | os.W_OK):
        return "given"
    group = ""
    with suppress(OSError, KeyError):  # gone, or a group without a name
        group = port.device.group()
    # Who joins the group root to reach a board can do far more than that.
    fail_if(group == "root", "port_of_root")
    raise CheckFailedError("port_forbidden", group=group or "its group", join=group or "dialout")


def check_owners(port: PortPlace) -> str:
    """See that no other process has the port open; other users' processes do not say."""
    owners = list(_owners(port))
    if not owners:
        return "none seen"
    code = "port_of_daemon" if any("daemon" in owner for owner in owners) else "port_in_use"
    raise CheckFailedError(code, owners=", ".join(owners))


def check_modem_manager(port: PortPlace) -> str:
    """See that ModemManager does not take the board for a modem."""
    if all(name != "ModemManager" for _, name in _processes(port.proc)):
        return "it does not run"
    with suppress(OSError):
        number = port.device.stat().st_rdev
        account = port.udev / f"c{os.major(number)}:{os.minor(number)}"
        if any(line in _IGNORED for line in account.read_text("utf-8", "replace").splitlines()):
            return "it is told to leave this port alone"
    raise CheckFailedError("modem_manager")


PORT_CHECKS = {
    "permission for {path}": check_permission,
    "other users of {path}": check_owners,
    "ModemManager and {path}": check_modem_manager,
}


def check_packages(owner: str) -> str:
    """See that no package but the owner has modules of the name `rig`, and mixes them with ours."""
    names = sorted(set(packages_distributions().get("rig", ())) - {owner})
    fail_if(names, "packages_mixed", packages=", ".join(names), names=" ".join(names))
    return "only this one"


def describe_cache(cache: CacheFile) -> str:
    """Say how much room kept results take."""
    folder, size = cache.folder, cache.size()
    if size is None:
        return f"none: {folder} is not a folder in which this user, and nobody else, can write"
    used = f"{size.entries} of {size.used_bytes / 1e6:.1f} MB in {folder}"
    return f"{used}; --clear-cache forgets them"


def check_room(folder: Path) -> str:
    """See that there is room for a session in a folder, or in the first above it that is there."""
    place = folder.absolute()
    while not place.exists():
        place = place.parent
    free = shutil.disk_usage(place).free
    values = {"free_mb": free / 1e6, "needed_mb": ROOM / 1e6}
    fail_if(free < ROOM, "disk_full", folder=str(place), **values)
    return f"{free / 1e6:.0f} MB free in {place}"


def _processes(proc: Path) -> Iterator[tuple[Path, str]]:
    for folder in proc.glob("[0-9]*"):
        with suppress(OSError):  # it has ended meanwhile
            yield folder, (folder / "comm").read_text("utf-8", "replace").strip()


def _owners(port: PortPlace) -> Iterator[str]:
    for folder, name in _processes(port.proc):
        if folder.name == str(os.getpid()):
            continue
        with suppress(OSError):
            handles = (folder / "fd").iterdir()
            if str(port.device) in map(os.path.realpath, handles):
                words = (folder / "cmdline").read_bytes().split(b"\0")
                command = b" ".join(words).decode("utf-8", "replace").strip()
                yield f"{command or name} (process {folder.name})"
