"""Checks of a port, a board, a session file and its disk: each is a function of facts alone.

A check returns what is well, in words, or raises why it is not.
"""

from __future__ import annotations

import cmath
from collections import Counter
from math import tau
from typing import TYPE_CHECKING, Any

from rig.link.gatewatch import listed
from rig.link.messages import HOST_SILENCE_MS, unpack_label
from rig.link.restarts import causes
from rig.selftest.findings import CheckFailedError, make_check
from rig.selftest.line_checks import judge_clock

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from rig.cache.store import CacheSize
    from rig.doctor.gathering import BoardFacts, PortFacts, SessionFacts
    from rig.selftest.findings import Finding

ROOM = 200 * 10**6
"""Bytes that should be free: a day of drops takes a few tens of MB, and its log as much again."""
_MAINS_HZ = (50, 60, 100, 120)  # lamps flicker at twice the mains' frequency
_IN_STEP = 0.8
_ENOUGH = 10  # edges to tell a rhythm from chance


def check_all(checks: Mapping[str, Callable[[Any], str]], facts: Any) -> Iterator[Finding]:
    """Make the checks of a table; a name may hold the path that the facts are about."""
    for name, check in checks.items():
        yield make_check(name.format(path=getattr(facts, "path", "")), check, facts)


def other_packages(names: Sequence[str]) -> str:
    """See that no other installed package has modules of the name `rig`, and mixes them with ours.

    Parameters
    ----------
    names
        Of these packages.
    """
    if names:
        raise CheckFailedError("packages_mixed", packages=", ".join(names), names=" ".join(names))
    return "only this one"


def _permission(port: PortFacts) -> str:
    """See that this user may read and write the port."""
    if not port.exists:
        raise CheckFailedError("port_missing")
    if port.usable:
        return "given"
    if port.group == "root":  # who joins it to reach a board can do far more than that
        raise CheckFailedError("port_of_root")
    group, join = port.group or "its group", port.group or "dialout"
    raise CheckFailedError("port_forbidden", group=group, join=join)


def _other_owners(port: PortFacts) -> str:
    """See that no other process has the port open."""
    if not port.owners:
        return "none seen"
    owners = ", ".join(f"{owner.command} (process {owner.pid})" for owner in port.owners)
    daemon = any("daemon" in owner.command for owner in port.owners)
    raise CheckFailedError("port_of_daemon" if daemon else "port_in_use", owners=owners)


def _modem_manager(port: PortFacts) -> str:
    """See that ModemManager does not take the board for a modem."""
    if not port.modem_manager:
        return "it does not run"
    if not port.left_alone:
        raise CheckFailedError("modem_manager")
    return "it is told to leave this port alone"


def _firmware(board: BoardFacts) -> str:
    """See that the board has the firmware that comes with this program."""
    firmware = board.identity.firmware
    if not board.shipped:
        return f"{firmware}; none for a {board.identity.board} comes with rig"
    if firmware != board.shipped:
        raise CheckFailedError("firmware_differs", firmware=firmware, shipped=board.shipped)
    return f"{firmware}, as it comes with rig"


def _held_drop(board: BoardFacts) -> str:
    """See that the board holds no drop that somebody waits for."""
    if board.held is not None:
        raise CheckFailedError("drop_held", run=board.held[0], attempt=board.held[1])
    return "none"


def _round_trip(board: BoardFacts) -> str:
    """See that answers come fast enough to keep an armed board armed."""
    if not board.pings:
        raise CheckFailedError("no_ping")
    slowest = max(ping.host_recv_ns - ping.host_send_ns for ping in board.pings) * 1e-9
    if slowest > HOST_SILENCE_MS / 2000:
        raise CheckFailedError("slow_answers", slowest_s=slowest)
    return f"{slowest * 1e3:.1f} ms at most"


def _emergency_stop(board: BoardFacts) -> str:
    """See that the emergency stop lets the board arm."""
    if board.stopped:
        raise CheckFailedError("stop_open")
    return "closed" if board.edges is not None else "not tried"


def _stuck_gates(board: BoardFacts) -> str:
    """See that no gate is blocked all the time."""
    if board.states.stuck:
        raise CheckFailedError("gates_blocked", gates_listed=listed(board.states.stuck))
    return "none"


def _flickering_gates(board: BoardFacts) -> str:
    """See that no gate changes while nothing moves, and whether the mains do it if one does."""
    if not board.edges:
        if seen := board.states.flickering:
            raise CheckFailedError("gates_flicker", gates_listed=listed(seen))
        if board.edges is None:
            return f"none seen at a glance; not recorded: {board.unwatched}"
        return f"none within {board.watched_s:g} s"
    rises: dict[int, list[float]] = {}
    for edge in board.edges:
        if edge.blocked:
            rises.setdefault(edge.channel, []).append(edge.tick / board.identity.tick_hz)
    ripples = {channel: mains_ripple(times) for channel, times in sorted(rises.items())}
    gates = "; ".join(
        f"gate {channel} {len(rises[channel])} times" + (f", in step with {hz} Hz" if hz else "")
        for channel, hz in ripples.items()
    )
    code = "gates_flicker_mains" if any(ripples.values()) else "gates_flicker"
    raise CheckFailedError(code, gates_listed=f"{gates} within {board.watched_s:g} s")


def mains_ripple(times_s: Sequence[float]) -> int | None:
    """Find the mains' rhythm in a gate's edges.

    Parameters
    ----------
    times_s
        When the gate was blocked, over about a second.

    Returns
    -------
    int or None
        The lowest of 50, 60, 100 and 120 Hz with which the edges keep step: the length of their
        mean phasor is above 0.8, where edges at random times would give 1/√n.
    """
    if len(times_s) < _ENOUGH:
        return None
    for hz in _MAINS_HZ:
        mean = sum(cmath.exp(1j * tau * hz * t) for t in times_s) / len(times_s)
        if abs(mean) > _IN_STEP:
            return hz
    return None


def kept_results(cache: tuple[str, CacheSize | None]) -> str:
    """Say how much room kept results take."""
    folder, size = cache
    if size is None:
        return f"none: {folder} is not a folder in which this user, and nobody else, can write"
    used = f"{size.entries} of {size.used_bytes / 1e6:.1f} MB in {folder}"
    return f"{used}; --clear-cache forgets them"


def disk_room(room: tuple[str, int]) -> str:
    """See that there is room for a session: in a folder, so many bytes are free."""
    folder, free = room
    if free < ROOM:
        raise CheckFailedError("disk_full", folder=folder, free_mb=free / 1e6, needed_mb=ROOM / 1e6)
    return f"{free / 1e6:.0f} MB free in {folder}"


def _session_file(facts: SessionFacts) -> str:
    """See that a session file is whole."""
    if facts.foreign:
        raise CheckFailedError("no_session", text=facts.foreign)
    if facts.trouble:
        raise CheckFailedError("session_damaged", text=facts.trouble, path=facts.path)
    return f"whole, being written by {facts.writer}" if facts.writer else "whole"


def _restarts(facts: SessionFacts) -> str:
    """See that the board did not restart by itself while the session was made."""
    counts: Counter[str] = Counter()
    for restart in facts.restarts:
        cause = causes(restart.cause)
        when = restart.when + (f" ({cause})" if cause else "")
        if restart.label is not None:
            when = "run {}, attempt {}: ".format(*unpack_label(restart.label)) + when
        counts[when] += 1
    for name, mask in facts.unseen:
        cause = causes(mask)
        counts[f"{name}: before it, unseen" + (f" ({cause})" if cause else "")] = 1
    if not counts:
        return "none"
    text = "; ".join(when + (f", {n} times" if n > 1 else "") for when, n in counts.items())
    raise CheckFailedError("board_restarts", text=text)


def _supply(facts: SessionFacts) -> str:
    """Say how far the board's supply sank while something fell."""
    if facts.sunk is None:
        return "not measured"
    name, at_fire, lowest = facts.sunk
    return f"at most from {at_fire:.2f} V to {lowest:.2f} V, in {name}"


PORT_CHECKS = {
    "permission for {path}": _permission,
    "other users of {path}": _other_owners,
    "ModemManager and {path}": _modem_manager,
}
BOARD_CHECKS: Mapping[str, Callable[[BoardFacts], str]] = {
    "firmware": _firmware,
    "held drop": _held_drop,
    "clock": lambda board: judge_clock(board.pings, board.identity.tick_hz),
    "round trip": _round_trip,
    "emergency stop": _emergency_stop,
    "blocked gates": _stuck_gates,
    "flickering gates": _flickering_gates,
}
SESSION_CHECK = {"session {path}": _session_file}
WHOLE_SESSION_CHECKS = {"restarts": _restarts, "supply": _supply}
"""Of a session that is whole."""
