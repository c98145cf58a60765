"""Checks of a board: what it says of itself, its clock, its stop and its gates.

No release is driven, and no drop of anybody is touched. A check returns what is well, in words, or
raises why it is not.
"""

from __future__ import annotations

import cmath
from contextlib import suppress
from dataclasses import dataclass
from math import tau
from typing import TYPE_CHECKING

from rig.flash.boards import UNSEEN
from rig.flash.image import shipped_firmware
from rig.link.client import Device
from rig.link.gatewatch import GateStates, name_gates, watch_gates
from rig.link.messages import HOST_SILENCE_MS, Arm, Identity, Phase, RefusalReason, unpack_label
from rig.link.refusals import DeviceRefusedError
from rig.reasons import Reason, make_reason
from rig.selftest.board import LABEL
from rig.selftest.findings import CheckFailedError, fail_if
from rig.selftest.line_checks import judge_clock

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from rig.clock.host import Clock
    from rig.link.port import Port
    from rig.records import ClockSample, Edge

_GLANCE_S = 0.3
_WATCH_S = 1.0
_PINGS = 40
_TRIES = 40
_AGAIN = (RefusalReason.GATE_BLOCKED, RefusalReason.GATE_UNSTEADY)
"""Refusals that a flickering gate gives now and then."""
_MAINS_HZ = (50, 60, 100, 120)  # lamps flicker at twice the mains' frequency
_IN_STEP = 0.8
_ENOUGH = 10  # edges to tell a rhythm from chance


@dataclass(frozen=True, slots=True)
class BoardFacts:
    """What a board says and does.

    Attributes
    ----------
    shipped
        The firmware that comes with this program for such a board; empty when none does.
    states
        Its gates as STATUS had them for a moment.
    edges
        Of all gates that were not blocked, for a second, from a recording without a release; or
        the reason for which none could be made.
    """

    identity: Identity
    shipped: str
    pings: tuple[ClockSample, ...]
    states: GateStates
    edges: tuple[Edge, ...] | Reason


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
    edges: tuple[Edge, ...] | Reason
    if state.phase is not Phase.IDLE:
        run, attempt = unpack_label(state.label)
        edges = make_reason("drop_held", run=run, attempt=attempt)
    elif clear := ((1 << identity.gates) - 1) & ~states.stuck:
        edges = _record_gates(device, clear)
    else:
        edges = make_reason("gates_blocked", gates_listed=name_gates(states.stuck))
    return BoardFacts(identity, shipped_firmware(identity.board), tuple(pings), states, edges)


def _record_gates(device: Device, gates: int) -> tuple[Edge, ...] | Reason:
    """Record the gates with all releases off; else say why that cannot be.

    A board fires only when all its gates are clear and keep still. One that flickers with the
    mains does so for some milliseconds between two pulses, so a few tries in a row get there.
    """
    order = Arm(LABEL, gates, 0, 0, timeout_ms=1000, record_ms=round(_WATCH_S * 1000))
    for _ in range(_TRIES):
        try:
            device.fire(device.arm(order))
        except DeviceRefusedError as refusal:
            reason: Reason = refusal.reasons[0]
            if refusal.reason not in _AGAIN:
                break
        else:
            drop = device.collect(LABEL)
            if drop.certificate is not None:
                device.acknowledge(LABEL, drop.certificate.crc32)
            return drop.edges
    with suppress(DeviceRefusedError):
        device.abort()
    return reason


def _firmware(board: BoardFacts) -> str:
    """See that the board has the firmware that comes with this program."""
    firmware = board.identity.firmware
    if not board.shipped:
        return f"{firmware}; none for a {board.identity.board} comes with rig"
    differs = firmware != board.shipped
    fail_if(differs, "firmware_differs", firmware=firmware, shipped=board.shipped)
    return f"{firmware}, as it comes with rig; {UNSEEN}"


def _held_drop(board: BoardFacts) -> str:
    """See that the board holds no drop that somebody waits for."""
    if isinstance(board.edges, Reason) and board.edges.code == "drop_held":
        raise CheckFailedError("drop_held", **board.edges.values)
    return "none"


def _round_trip(board: BoardFacts) -> str:
    """See that answers come fast enough to keep an armed board armed."""
    fail_if(not board.pings, "no_ping")
    slowest = max(ping.host_recv_ns - ping.host_send_ns for ping in board.pings) * 1e-9
    fail_if(slowest > HOST_SILENCE_MS / 2000, "slow_answers", slowest_s=slowest)
    return f"{slowest * 1e3:.1f} ms at most"


def _emergency_stop(board: BoardFacts) -> str:
    """See that the emergency stop lets the board arm."""
    if not isinstance(board.edges, Reason):
        return "closed"
    fail_if(board.edges.code == "refused_stopped", "stop_open")
    return "not tried"


def _stuck_gates(board: BoardFacts) -> str:
    """See that no gate is blocked all the time."""
    stuck = board.states.stuck
    fail_if(stuck, "gates_blocked", gates_listed=name_gates(stuck))
    return "none"


def _flickering_gates(board: BoardFacts) -> str:
    """See that no gate changes while nothing moves, and whether the mains do it if one does."""
    edges = board.edges
    if isinstance(edges, Reason) or not edges:
        flickering = board.states.flickering
        fail_if(flickering, "gates_flicker", gates_listed=name_gates(flickering))
        if isinstance(edges, Reason):
            return f"none seen at a glance; not recorded: {edges}"
        return f"none within {_WATCH_S:g} s"
    rises: dict[int, list[float]] = {}
    for edge in edges:
        if edge.blocked:
            rises.setdefault(edge.channel, []).append(edge.tick / board.identity.tick_hz)
    ripples = {channel: mains_ripple(times) for channel, times in sorted(rises.items())}
    gates = "; ".join(
        f"gate {channel} {len(rises[channel])} times" + (f", in step with {hz} Hz" if hz else "")
        for channel, hz in ripples.items()
    )
    code = "gates_flicker_mains" if any(ripples.values()) else "gates_flicker"
    raise CheckFailedError(code, gates_listed=f"{gates} within {_WATCH_S:g} s")


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
    count = len(times_s)
    phasors = {hz: sum(cmath.exp(1j * tau * hz * t) for t in times_s) for hz in _MAINS_HZ}
    in_step = (hz for hz, phasor in phasors.items() if abs(phasor) > _IN_STEP * count)
    return next(in_step, None) if count >= _ENOUGH else None


BOARD_CHECKS: Mapping[str, Callable[[BoardFacts], str]] = {
    "firmware": _firmware,
    "held drop": _held_drop,
    "clock": lambda board: judge_clock(board.pings, board.identity.tick_hz),
    "round trip": _round_trip,
    "emergency stop": _emergency_stop,
    "blocked gates": _stuck_gates,
    "flickering gates": _flickering_gates,
}
