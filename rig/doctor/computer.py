"""Checks of this computer: who may and does use a port, other packages, disk and kept results.

A check returns what is well, in words, or raises why it is not. No port is opened.
"""

import os
import re
import shutil
from collections.abc import Iterator
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, packages_distributions, requires, version
from pathlib import Path

from rig.cache.store import CacheFolder
from rig.selftest.findings import fail_if

ROOM = 200 * 10**6
"""Bytes that should be free: a day of drops takes a few tens of MB, and its log as much again."""
_IGNORED = {"E:ID_MM_DEVICE_IGNORE=1", "E:ID_MM_PORT_IGNORE=1"}
_PROC = Path("/proc")
_UDEV = Path("/run/udev/data")
"""Where the kernel and udev keep their accounts."""


def check_permission(port: Path) -> str:
    """See that this user may read and write the port."""
    fail_if(not port.exists(), "port_missing")
    group, given = "", os.access(port, os.R_OK | os.W_OK)
    with suppress(OSError, KeyError):  # gone, or a group without a name
        group = port.group()
    # Who joins the group root to reach a board can do far more than that.
    fail_if(not given and group == "root", "port_of_root")
    fail_if(not given, "port_forbidden", group=group or "its group", join=group or "dialout")
    return "given"


def check_owners(port: Path) -> str:
    """See that no other process has the port open; other users' processes do not say."""
    owners = []
    for folder, command in _processes():
        with suppress(OSError):
            handles = map(os.path.realpath, (folder / "fd").iterdir())
            if folder.name != str(os.getpid()) and os.path.realpath(port) in handles:
                owners.append(f"{command} (process {folder.name})")
    code = "port_of_daemon" if any("daemon" in owner for owner in owners) else "port_in_use"
    fail_if(owners, code, owners=", ".join(owners))
    return "none seen"


def check_modem_manager(port: Path) -> str:
    """See that ModemManager does not take the board for a modem."""
    lines: list[str] = []
    with suppress(OSError):
        number = port.stat().st_rdev
        account = _UDEV / f"c{os.major(number)}:{os.minor(number)}"
        lines = account.read_text("utf-8", "replace").splitlines()
    programs = {Path(command.split(" ")[0]).name for _, command in _processes()}
    is_running = "ModemManager" in programs
    fail_if(is_running and _IGNORED.isdisjoint(lines), "modem_manager")
    return "it is told to leave this port alone" if is_running else "it does not run"


def _processes() -> Iterator[tuple[Path, str]]:
    """Give each process's folder and its command."""
    for folder in _PROC.glob("[0-9]*"):
        with suppress(OSError):  # it has ended meanwhile
            words = (folder / "cmdline").read_bytes().split(b"\0")
            yield folder, b" ".join(words).decode("utf-8", "replace").strip()


PORT_CHECKS = {
    "permission for {path}": check_permission,
    "other users of {path}": check_owners,
    "ModemManager and {path}": check_modem_manager,
}


def check_packages(owner: str) -> str:
    """See that all that a package needs is there, and that no other one mixes its files with it."""
    names = sorted(set(packages_distributions().get("rig", ())) - {owner})
    fail_if(names, "packages_mixed", packages=", ".join(names), names=" ".join(names))
    present, lacking = [], []
    for needed in (row for row in requires(owner) or () if "extra ==" not in row):
        name = re.split(r"[^\w.-]", needed)[0]
        try:
            present.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            lacking.append(name)
    fail_if(lacking, "packages_lacking", packages=" ".join(lacking))
    return ", ".join(present)


def describe_cache(cache: CacheFolder) -> str:
    """Say how much room kept results take."""
    folder, sizes = cache.folder, cache.sizes()
    if sizes is None:
        return f"none: {folder} is not a folder in which this user, and nobody else, can write"
    used = f"{len(sizes)} of {sum(sizes) / 1e6:.1f} MB in {folder}"
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
