"""Checks of a port, a board, a session file and its disk: each is a function of facts alone."""

from __future__ import annotations

import cmath
from collections import Counter
from math import tau
from typing import TYPE_CHECKING

from rig.link.gatewatch import listed
from rig.link.messages import HOST_SILENCE_MS, unpack_label
from rig.link.restarts import causes
from rig.reasons import make_reason
from rig.selftest.findings import CheckFailedError, Finding, explain
from rig.selftest.line_checks import judge_clock

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.cache.store import CacheSize
    from rig.doctor.facts import BoardFacts, DiskFacts, PortFacts, SessionFacts

ROOM = 200 * 10**6
"""Bytes that should be free: a day of drops takes a few tens of MB, and its log as much again."""
_MAINS_HZ = (50, 60, 100, 120)  # lamps flicker at twice the mains' frequency
_IN_STEP = 0.8
_ENOUGH = 10  # edges to tell a rhythm from chance


def problem(name: str, code: str, **values: object) -> Finding:
    """Make a finding of a code of `rig.wordings` and its values."""
    return explain(name, make_reason(code, **values))


def other_packages(names: Sequence[str]) -> Finding:
    """See that no other installed package has modules of the name `rig`, and mixes them with ours.

    Parameters
    ----------
    names
        Of these packages.
    """
    name = "packages called rig"
    if not names:
        return Finding(name, "only this one")
    return problem(name, "packages_mixed", packages=", ".join(names), names=" ".join(names))


def permission(port: PortFacts) -> Finding:
    """See that this user may read and write the port."""
    name = f"permission for {port.path}"
    if not port.exists:
        return problem(name, "port_missing")
    if port.usable:
        return Finding(name, "given")
    if port.group == "root":  # who joins it to reach a board can do far more than that
        return problem(name, "port_of_root")
    group, join = port.group or "its group", port.group or "dialout"
    return problem(name, "port_forbidden", group=group, join=join)


def other_owners(port: PortFacts) -> Finding:
    """See that no other process has the port open."""
    name = f"other users of {port.path}"
    if not port.owners:
        return Finding(name, "none seen")
    owners = ", ".join(f"{owner.command} (process {owner.pid})" for owner in port.owners)
    daemon = any("daemon" in owner.command for owner in port.owners)
    return problem(name, "port_of_daemon" if daemon else "port_in_use", owners=owners)


def modem_manager(port: PortFacts) -> Finding:
    """See that ModemManager does not take the board for a modem."""
    name = f"ModemManager and {port.path}"
    if not port.modem_manager:
        return Finding(name, "it does not run")
    if port.left_alone:
        return Finding(name, "it is told to leave this port alone")
    return problem(name, "modem_manager")


def firmware(board: BoardFacts) -> Finding:
    """See that the board has the firmware that comes with this program."""
    has = board.identity.firmware
    if not board.shipped:
        return Finding("firmware", f"{has}; none for a {board.identity.board} comes with rig")
    if has == board.shipped:
        return Finding("firmware", f"{has}, as it comes with rig")
    return problem("firmware", "firmware_differs", firmware=has, shipped=board.shipped)


def held_drop(board: BoardFacts) -> Finding:
    """See that the board holds no drop that somebody waits for."""
    if board.held is None:
        return Finding("held drop", "none")
    run, attempt = board.held
    return problem("held drop", "drop_held", run=run, attempt=attempt)


def clock(board: BoardFacts) -> Finding:
    """See that the board's clock is within what a resonator may be off."""
    try:
        return Finding("clock", judge_clock(board.pings, board.identity.tick_hz))
    except CheckFailedError as failure:
        return explain("clock", failure.reason)


def round_trip(board: BoardFacts) -> Finding:
    """See that answers come fast enough to keep an armed board armed."""
    if not board.pings:
        return problem("round trip", "no_ping")
    slowest = max(ping.host_recv_ns - ping.host_send_ns for ping in board.pings) * 1e-9
    if slowest > HOST_SILENCE_MS / 2000:
        return problem("round trip", "slow_answers", slowest_s=slowest)
    return Finding("round trip", f"{slowest * 1e3:.1f} ms at most")


def emergency_stop(board: BoardFacts) -> Finding:
    """See that the emergency stop lets the board arm."""
    if board.stopped:
        return problem("emergency stop", "stop_open")
    return Finding("emergency stop", "closed" if board.edges is not None else "not tried")


def stuck_gates(board: BoardFacts) -> Finding:
    """See that no gate is blocked all the time."""
    stuck = board.states.stuck
    if not stuck:
        return Finding("blocked gates", "none")
    return problem("blocked gates", "gates_blocked", gates_listed=listed(stuck))


def flickering_gates(board: BoardFacts) -> Finding:
    """See that no gate changes while nothing moves, and whether the mains do it if one does."""
    name = "flickering gates"
    if not board.edges:
        if seen := board.states.flickering:
            return problem(name, "gates_flicker", gates_listed=listed(seen))
        if board.edges is None:
            return Finding(name, f"none seen at a glance; not recorded: {board.unwatched}")
        return Finding(name, f"none within {board.watched_s:g} s")
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
    return problem(name, code, gates_listed=f"{gates} within {board.watched_s:g} s")


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


def kept_results(folder: str, size: CacheSize | None) -> Finding:
    """Say how much room kept results take."""
    if size is None:
        why = "not a folder in which this user, and nobody else, can write"
        return Finding("kept results", f"none: {folder} is {why}")
    what = f"{size.entries} of {size.used_bytes / 1e6:.1f} MB in {folder}"
    return Finding("kept results", f"{what}; --clear-cache forgets them")


def disk_room(facts: DiskFacts) -> Finding:
    """See that there is room for a session."""
    free = facts.free / 1e6
    if facts.free < ROOM:
        values = {"free_mb": free, "needed_mb": ROOM / 1e6}
        return problem("disk", "disk_full", folder=facts.folder, **values)
    return Finding("disk", f"{free:.0f} MB free in {facts.folder}")


def session_file(facts: SessionFacts) -> Finding:
    """See that a session file is whole."""
    name = f"session {facts.path}"
    if facts.foreign:
        return problem(name, "no_session", text=facts.foreign)
    if not facts.whole:
        return problem(name, "session_damaged", text=facts.first_trouble, path=facts.path)
    return Finding(name, f"whole, being written by {facts.writer}" if facts.writer else "whole")


def restarts(facts: SessionFacts) -> Finding:
    """See that the board did not restart by itself while the session was made."""
    counts: Counter[str] = Counter()
    for restart in facts.restarts:
        why = causes(restart.cause)
        when = restart.when + (f" ({why})" if why else "")
        if restart.label is not None:
            when = "run {}, attempt {}: ".format(*unpack_label(restart.label)) + when
        counts[when] += 1
    for name, mask in facts.unseen:
        why = causes(mask)
        counts[f"{name}: before it, unseen" + (f" ({why})" if why else "")] = 1
    if not counts:
        return Finding("restarts", "none")
    text = "; ".join(when + (f", {n} times" if n > 1 else "") for when, n in counts.items())
    return problem("restarts", "board_restarts", text=text)


def supply(facts: SessionFacts) -> Finding:
    """Say how far the board's supply sank while something fell."""
    if facts.sunk is None:
        return Finding("supply", "not measured")
    name, at_fire, lowest = facts.sunk
    return Finding("supply", f"at most from {at_fire:.2f} V to {lowest:.2f} V, in {name}")
