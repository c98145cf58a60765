"""Checks of a port, a board, a session file and its disk: each is a function of facts alone."""

from __future__ import annotations

import cmath
from dataclasses import dataclass
from math import tau
from typing import TYPE_CHECKING

from rig.clock.epochs import RESONATOR_TOLERANCE
from rig.clock.rate import tick_rate
from rig.link.gatewatch import listed
from rig.link.messages import HOST_SILENCE_MS, unpack_label
from rig.link.restarts import SUPPLY, WIRING, causes

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.doctor.facts import BoardFacts, DiskFacts, PortFacts, SessionFacts

RULE = (
    "python -m rig.usb.udev | sudo tee /etc/udev/rules.d/60-chainrig.rules, then "
    "sudo udevadm control --reload and sudo udevadm trigger"
)
ROOM = 200 * 10**6
"""Bytes that should be free: a day of drops takes a few tens of MB, and its log as much again."""
_MAINS_HZ = (50, 60, 100, 120)  # lamps flicker at twice the mains' frequency
_IN_STEP = 0.8
_ENOUGH = 10  # edges to tell a rhythm from chance
_BEAM = "clear the beam, and see that its emitter has power and its plugs sit"


@dataclass(frozen=True, slots=True)
class Finding:
    """One line of the doctor's; with an advice it is a trouble, without one all is well."""

    name: str
    what: str
    advice: str = ""

    def __str__(self) -> str:
        if self.advice:
            return f"{self.name}: {self.what}\n  do: {self.advice}"
        return f"{self.name}: {self.what}"


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
    said = ", ".join(names)
    advice = f"python -m pip uninstall {' '.join(names)} chainrig, then install chainrig again"
    return Finding(name, f"{said} too: files of both are in one folder", advice)


def permission(port: PortFacts) -> Finding:
    """See that this user may read and write the port."""
    name = f"permission for {port.path}"
    if not port.exists:
        return Finding(name, "there is no such port", "is the board plugged in? rig ports")
    if port.usable:
        return Finding(name, "given")
    group = port.group or "its group"
    # Who joins root to reach a board can do far more than that.
    join = (
        ""
        if group == "root"
        else (f"sudo usermod -aG {port.group or 'dialout'} $USER and log in again, or ")
    )
    return Finding(name, f"not given: it belongs to the group {group}", f"{join}{RULE}")


def other_owners(port: PortFacts) -> Finding:
    """See that no other process has the port open."""
    name = f"other users of {port.path}"
    if not port.owners:
        return Finding(name, "none seen")
    said = ", ".join(f"{owner.command} (process {owner.pid})" for owner in port.owners)
    daemon = any("daemon" in owner.command for owner in port.owners)
    advice = "let that daemon do the work: rig run and rig tui ask it" if daemon else ""
    return Finding(name, said, advice or "close that program")


def modem_manager(port: PortFacts) -> Finding:
    """See that ModemManager does not take the board for a modem."""
    name = f"ModemManager and {port.path}"
    if not port.modem_manager:
        return Finding(name, "it does not run")
    if port.left_alone:
        return Finding(name, "it is told to leave this port alone")
    return Finding(name, "it may speak to the board, which restarts it", RULE)


def firmware(board: BoardFacts) -> Finding:
    """See that the board has the firmware that comes with this program."""
    has = board.identity.firmware
    if not board.shipped:
        return Finding("firmware", f"{has}; none for a {board.identity.board} comes with rig")
    if has == board.shipped:
        return Finding("firmware", f"{has}, as it comes with rig")
    return Finding("firmware", f"{has}, but {board.shipped} comes with rig", "rig flash")


def held_drop(board: BoardFacts) -> Finding:
    """See that the board holds no drop that somebody waits for."""
    if board.held is None:
        return Finding("held drop", "none")
    run, attempt = board.held
    return Finding(
        "held drop", f"run {run}, attempt {attempt}", "continue the session it belongs to: rig run"
    )


def clock(board: BoardFacts) -> Finding:
    """See that the board's clock is within what a resonator may be off."""
    nominal = board.identity.tick_hz
    rate = tick_rate(board.pings, nominal)
    if not rate.n:
        return Finding(
            "clock",
            f"its rate cannot be told from {len(board.pings)} pings",
            "take another cable or USB port; is the firmware for this very board? rig flash",
        )
    off, u = rate.hz / nominal - 1, rate.u_hz / nominal
    said = f"{off * 1e6:+.0f} ± {2 * u * 1e6:.0f} ppm"
    if abs(off) > RESONATOR_TOLERANCE + 2 * u:
        return Finding("clock", said, "its resonator is broken: take another board")
    return Finding("clock", said)


def round_trip(board: BoardFacts) -> Finding:
    """See that answers come fast enough to keep an armed board armed."""
    if not board.pings:
        return Finding("round trip", "no ping came through", "take another cable or USB port")
    slowest = max(ping.host_recv_ns - ping.host_send_ns for ping in board.pings) * 1e-6
    said = f"{slowest:.1f} ms at most"
    if slowest > HOST_SILENCE_MS / 2:
        return Finding("round trip", said, "close what keeps this computer busy; no USB hub")
    return Finding("round trip", said)


def emergency_stop(board: BoardFacts) -> Finding:
    """See that the emergency stop lets the board arm."""
    if board.stopped:
        return Finding("emergency stop", "open", "close it, or plug its cable in: it opens too")
    return Finding("emergency stop", "closed" if board.edges is not None else "not tried")


def stuck_gates(board: BoardFacts) -> Finding:
    """See that no gate is blocked all the time."""
    stuck = board.states.stuck
    if not stuck:
        return Finding("blocked gates", "none")
    return Finding(
        "blocked gates", listed(stuck), f"{_BEAM}; an input without a gate reads so too: leave it"
    )


def flickering_gates(board: BoardFacts) -> Finding:
    """See that no gate changes while nothing moves, and whether the mains do it if one does."""
    name = "flickering gates"
    if not board.edges:
        if seen := board.states.flickering:
            return Finding(name, listed(seen), f"{_BEAM}; let everything come to rest")
        if board.edges is None:
            return Finding(name, f"none seen at a glance; not recorded: {board.unwatched}")
        return Finding(name, f"none within {board.watched_s:g} s")
    rises: dict[int, list[float]] = {}
    for edge in board.edges:
        if edge.blocked:
            rises.setdefault(edge.channel, []).append(edge.tick / board.identity.tick_hz)
    said, mains = [], False
    for channel, times in sorted(rises.items()):
        hz = mains_ripple(times)
        mains |= hz is not None
        said.append(
            f"gate {channel} {len(times)} times" + (f", in step with {hz} Hz" if hz else "")
        )
    lamp = "keep lamps off the receivers and mains leads off the cables; shield the beams"
    return Finding(
        name,
        "; ".join(said) + f" within {board.watched_s:g} s",
        lamp if mains else f"{_BEAM}; let everything come to rest",
    )


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


def disk_room(facts: DiskFacts) -> Finding:
    """See that there is room for a session."""
    said = f"{facts.free / 1e6:.0f} MB free in {facts.folder}"
    if facts.free < ROOM:
        return Finding("disk", said, f"free {ROOM / 1e6:.0f} MB there, or keep sessions elsewhere")
    return Finding("disk", said)


def session_file(facts: SessionFacts) -> Finding:
    """See that a session file is whole."""
    name = f"session {facts.path}"
    if facts.foreign:
        return Finding(name, f"not a session: {facts.foreign}", "name a file made by rig run")
    if not facts.whole:
        return Finding(
            name, f"damaged: {facts.first_trouble}", f"rig recover {facts.path} -o NEW.session"
        )
    return Finding(name, f"whole, being written by {facts.writer}" if facts.writer else "whole")


def restarts(facts: SessionFacts) -> Finding:
    """See that the board did not restart by itself while the session was made."""
    told: dict[str, int] = {}
    for one in facts.restarts:
        why = causes(one.cause)
        what = one.when + (f" ({why})" if why else "")
        if one.label is not None:
            what = "run {}, attempt {}: ".format(*unpack_label(one.label)) + what
        told[what] = told.get(what, 0) + 1
    for name, mask in facts.unseen:
        why = causes(mask)
        told[f"{name}: before it, unseen" + (f" ({why})" if why else "")] = 1
    if not told:
        return Finding("restarts", "none")
    said = "; ".join(what + (f", {n} times" if n > 1 else "") for what, n in told.items())
    return Finding("restarts", said, f"{SUPPLY} Give them one of their own, and check {WIRING}")


def supply(facts: SessionFacts) -> Finding:
    """Say how far the board's supply sank while chains fell."""
    if facts.sunk is None:
        return Finding("supply", "not measured")
    name, at_fire, lowest = facts.sunk
    return Finding("supply", f"at most from {at_fire:.2f} V to {lowest:.2f} V, in {name}")
