"""Gathering facts about a board, its port and this computer, which all stay as they are.

No release is driven, and no drop of anybody is touched.
"""

from __future__ import annotations

import os
import shutil
from contextlib import suppress
from dataclasses import replace
from importlib.metadata import packages_distributions
from pathlib import Path
from typing import TYPE_CHECKING

from rig.doctor.facts import BoardFacts, DiskFacts, Owner, PortFacts, SessionFacts
from rig.flash.image import shipped_firmware
from rig.link.client import Device
from rig.link.gatewatch import watch_gates
from rig.link.messages import TEST_RUN, Phase, RefusalReason, pack_label, unpack_label
from rig.link.refusals import DeviceRefusedError
from rig.link.restarts import Restart
from rig.link.transcript import Transcript
from rig.recover.examine import examine
from rig.session.store import Session

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rig.clock.host import Clock
    from rig.link.port import Port
    from rig.records import Edge

_PROC = Path("/proc")
_UDEV = Path("/run/udev/data")
_IGNORED = ("E:ID_MM_DEVICE_IGNORE=1", "E:ID_MM_PORT_IGNORE=1")
WATCH_S = 1.0
_GLANCE_S = 0.3
_PINGS = 40
_LABEL = pack_label(TEST_RUN, 1)
_TRIES = 40
_AGAIN = (RefusalReason.GATE_BLOCKED, RefusalReason.GATE_UNSTEADY)
"""Refusals that a flickering gate gives now and then."""


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


def look_at_packages() -> tuple[str, ...]:
    """Name installed packages that have modules called `rig` beside ours."""
    return tuple(sorted(set(packages_distributions().get("rig", ())) - {"chainrig"}))


def look_at_disk(folder: Path) -> DiskFacts:
    """Gather how much room there is in a folder, or where it will be made."""
    place = folder.absolute()
    while not place.exists():
        place = place.parent
    return DiskFacts(str(place), shutil.disk_usage(place).free)


def look_at_session(path: str) -> SessionFacts:
    """Gather what is whole of a session file."""
    file = examine(path)
    trouble = next(iter(file.troubles), "")
    facts = SessionFacts(path, file.whole, file.foreign, file.snapshot.writer, trouble)
    return _look_at_drops(facts) if file.whole else facts


def _look_at_drops(facts: SessionFacts) -> SessionFacts:
    """Read what a whole session tells of its board's restarts and supply."""
    with Session.open(facts.path, readonly=True) as session:
        transcript = Transcript()
        restarts = tuple(
            record
            for host_ns, direction, data in session.byte_log()
            for record in transcript.feed(direction, host_ns, data)
            if isinstance(record, Restart)
        )
        drops = [(f"run {d.run}, attempt {d.attempt}", d.certificate) for d in session.drops()]
    unseen = tuple((name, c.restarts) for name, c in drops if c and c.restarts)
    dips = [
        (c.lowest_mv / c.supply_mv, name, c.supply_mv / 1e3, c.lowest_mv / 1e3)
        for name, c in drops
        if c and c.supply_mv and c.lowest_mv
    ]
    return replace(facts, restarts=restarts, unseen=unseen, sunk=min(dips)[1:] if dips else None)


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
                command = b" ".join(words).decode("utf-8", "replace").strip()
                yield Owner(int(folder.name), command or name)


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


def look_at_board(port: Port, clock: Clock) -> BoardFacts:
    """Ask a board about everything that can be asked in a few seconds.

    Raises
    ------
    DeviceError
        It does not answer, or speaks another version.
    """
    device = Device(port, clock)
    identity = device.connect()
    pings = []
    for n in range(_PINGS):
        ping = device.ping()
        if ping is not None:
            pings.append(ping)
        clock.sleep(0.023 + 0.0071 * (n % 5))
    state = device.status()
    states = watch_gates(lambda: device.status().gates, clock, _GLANCE_S)
    edges, unwatched, stopped = None, "it holds a drop", False
    if state.phase is Phase.IDLE:
        clear = ((1 << identity.gates) - 1) & ~states.stuck
        edges, unwatched, stopped = _record_gates(device, clear)
    held = unpack_label(state.label) if state.phase is Phase.HOLDING else None
    shipped = shipped_firmware(identity.board)
    return BoardFacts(
        identity, shipped, tuple(pings), held, states, edges, WATCH_S, unwatched, stopped
    )


def _record_gates(device: Device, gates: int) -> tuple[tuple[Edge, ...] | None, str, bool]:
    """Record the gates for a while with all releases off; else say why not, and if it is stopped.

    A board fires only when all its gates are clear and keep still. One that flickers with the
    mains does so for some milliseconds between two pulses, so a few tries in a row get there.
    """
    if not gates:
        return None, "all gates are blocked", False
    why, stopped = "", False
    for _ in range(_TRIES):
        try:
            token = device.arm(
                label=_LABEL,
                gates=gates,
                release=0,
                pulse_us=0,
                timeout_ms=1000,
                record_ms=round(WATCH_S * 1000),
            )
            device.fire(token)
        except DeviceRefusedError as refusal:
            why, stopped = refusal.message, refusal.reason is RefusalReason.STOPPED
            if refusal.reason not in _AGAIN:
                break
            continue
        drop = device.collect(_LABEL)
        if drop.certificate is not None:
            device.acknowledge(_LABEL, drop.certificate.crc32)
        return drop.edges, "", False
    with suppress(DeviceRefusedError):
        device.abort()
    return None, why, stopped
