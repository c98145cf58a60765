"""Gathering facts about a board, its port and this computer, which all stay as they are.

No release is driven, and no drop of anybody is touched.
"""

from __future__ import annotations

import os
import shutil
from contextlib import suppress
from dataclasses import dataclass, replace
from importlib.metadata import packages_distributions
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

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
    from rig.link.gatewatch import GateStates
    from rig.link.messages import Identity
    from rig.link.port import Port
    from rig.records import ClockSample, Edge

_PROC = Path("/proc")
_UDEV = Path("/run/udev/data")
_IGNORED = ("E:ID_MM_DEVICE_IGNORE=1", "E:ID_MM_PORT_IGNORE=1")
_GLANCE_S = 0.3
_PINGS = 40
_LABEL = pack_label(TEST_RUN, 1)
_TRIES = 40
_AGAIN = (RefusalReason.GATE_BLOCKED, RefusalReason.GATE_UNSTEADY)
"""Refusals that a flickering gate gives now and then."""


class Owner(NamedTuple):
    """A process that has a port open."""

    pid: int
    command: str


@dataclass(frozen=True, slots=True)
class PortFacts:
    """A device path and who may and does use it.

    Attributes
    ----------
    exists, usable
        Whether it is there, and may be read and written by this user.
    group
        The group it belongs to.
    owners
        Other processes that have it open.
    modem_manager
        Whether ModemManager runs.
    left_alone
        Whether udev tells ModemManager to leave it alone.
    """

    path: str
    exists: bool
    usable: bool
    group: str
    owners: tuple[Owner, ...]
    modem_manager: bool
    left_alone: bool


@dataclass(frozen=True, slots=True)
class BoardFacts:
    """What a board says and does.

    Attributes
    ----------
    shipped
        The firmware that comes with this program for such a board; empty when none does.
    held
        Run and attempt of a drop that it holds, or `None`.
    states
        Its gates as STATUS had them for a moment.
    edges
        Of all gates that were not blocked, for `watched_s`, from a recording without a release;
        `None` when none could be made, for the reason `unwatched`.
    stopped
        Whether that was because the emergency stop is open.
    """

    identity: Identity
    shipped: str
    pings: tuple[ClockSample, ...]
    held: tuple[int, int] | None
    states: GateStates
    edges: tuple[Edge, ...] | None = None
    watched_s: float = 1.0
    unwatched: str = ""
    stopped: bool = False


@dataclass(frozen=True, slots=True)
class SessionFacts:
    """What `rig recover` says of a session file, and what its log of bytes tells of the board.

    Attributes
    ----------
    foreign, trouble
        Why it is no session, or the first of what is wrong with it; both empty for a whole one.
    writer
        Who writes it, in words.
    restarts
        Of the board, that nobody asked for.
    unseen
        Causes of restarts that no message told of, in the certificates of drops; by their names.
    sunk
        The drop in which the board's supply sank most, and its voltages at FIRE and lowest, V;
        `None` where it is not measured.
    """

    path: str
    foreign: str = ""
    trouble: str = ""
    writer: str = ""
    restarts: tuple[Restart, ...] = ()
    unseen: tuple[tuple[str, int], ...] = ()
    sunk: tuple[str, float, float] | None = None


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


def look_at_disk(folder: Path) -> tuple[str, int]:
    """Return a folder, or the first above it that is there, and how many bytes are free in it."""
    place = folder.absolute()
    while not place.exists():
        place = place.parent
    return str(place), shutil.disk_usage(place).free


def look_at_session(path: str) -> SessionFacts:
    """Gather what is whole of a session file."""
    examined = examine(path)
    trouble = next(iter(examined.troubles), "")
    facts = SessionFacts(path, examined.foreign, trouble, examined.snapshot.writer)
    return _look_at_drops(facts) if examined.whole else facts


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
    pings: list[ClockSample] = []
    for n in range(_PINGS):
        pings += filter(None, [device.ping()])
        clock.sleep(0.023 + 0.0071 * (n % 5))
    state = device.status()
    states = watch_gates(lambda: device.status().gates, clock, _GLANCE_S)
    facts = BoardFacts(
        identity,
        shipped_firmware(identity.board),
        tuple(pings),
        unpack_label(state.label) if state.phase is Phase.HOLDING else None,
        states,
    )
    clear = ((1 << identity.gates) - 1) & ~states.stuck
    if state.phase is not Phase.IDLE:
        return replace(facts, unwatched="it holds a drop")
    if not clear:
        return replace(facts, unwatched="all gates are blocked")
    return _record_gates(device, clear, facts)


def _record_gates(device: Device, gates: int, facts: BoardFacts) -> BoardFacts:
    """Add a recording of the gates with all releases off; else why there is none.

    A board fires only when all its gates are clear and keep still. One that flickers with the
    mains does so for some milliseconds between two pulses, so a few tries in a row get there.
    """
    order = {"timeout_ms": 1000, "record_ms": round(facts.watched_s * 1000)}
    for _ in range(_TRIES):
        try:
            device.fire(device.arm(label=_LABEL, gates=gates, release=0, pulse_us=0, **order))
        except DeviceRefusedError as refusal:
            stopped = refusal.reason is RefusalReason.STOPPED
            facts = replace(facts, unwatched=refusal.message, stopped=stopped)
            if refusal.reason not in _AGAIN:
                break
        else:
            drop = device.collect(_LABEL)
            if drop.certificate is not None:
                device.acknowledge(_LABEL, drop.certificate.crc32)
            return replace(facts, edges=drop.edges, unwatched="", stopped=False)
    with suppress(DeviceRefusedError):
        device.abort()
    return facts
