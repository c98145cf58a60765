"""What the checks are told."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rig.link.gatewatch import GateStates
    from rig.link.messages import Identity
    from rig.link.restarts import Restart
    from rig.records import ClockSample, Edge


@dataclass(frozen=True, slots=True)
class Owner:
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
    edges: tuple[Edge, ...] | None
    watched_s: float
    unwatched: str
    stopped: bool = False


@dataclass(frozen=True, slots=True)
class DiskFacts:
    """Where a session is, or will be, and how many bytes are free there."""

    folder: str
    free: int


@dataclass(frozen=True, slots=True)
class SessionFacts:
    """What `rig recover` says of a session file, and what its log of bytes tells of the board.

    Attributes
    ----------
    restarts
        Of the board, that nobody asked for.
    unseen
        Causes of restarts that no message told of, in the certificates of drops; by their names.
    sunk
        The drop in which the board's supply sank most, and its voltages at FIRE and lowest, V;
        `None` where it is not measured.
    """

    path: str
    whole: bool
    foreign: str
    writer: str
    first_trouble: str
    restarts: tuple[Restart, ...] = ()
    unseen: tuple[tuple[str, int], ...] = ()
    sunk: tuple[str, float, float] | None = None
