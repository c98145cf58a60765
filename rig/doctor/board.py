"""Checks of a board before a session: what the self-test has for that, and its light.

No release is driven, and no drop of anybody is touched.
"""

import cmath
from collections.abc import Mapping, Sequence
from math import tau

from rig.flash.boards import UNSEEN
from rig.flash.image import shipped_firmware
from rig.link.messages import RefusalReason
from rig.link.refusals import DeviceRefusedError
from rig.reasons import rig_error
from rig.selftest import checks, line_checks
from rig.selftest.board import BoardUnderTest, Check, RecordedDrop
from rig.selftest.findings import fail_if, need

_WATCH_S = 1.0
_TRIES = 40
_AGAIN = {RefusalReason.GATE_BLOCKED, RefusalReason.GATE_UNSTEADY}
"""Refusals that a flickering gate gives now and then."""
_MAINS_HZ = (50, 60, 100, 120)  # lamps flicker at twice the mains' frequency
_IN_STEP = 0.8
_ENOUGH = 10  # edges to tell a rhythm from chance


def check_firmware(board: BoardUnderTest) -> str:
    """See that the board has the firmware that comes with this program."""
    name, firmware = board.identity.board, board.identity.firmware
    shipped = shipped_firmware(name)
    if not shipped:
        return f"{firmware}; none for a {name} comes with rig"
    fail_if(firmware != shipped, "firmware_differs", firmware=firmware, shipped=shipped)
    return f"{firmware}, as it comes with rig; {UNSEEN}"


def check_held_drop(board: BoardUnderTest) -> str:
    """See that the board holds no drop that somebody waits for."""
    drop = board.foreign_drop()
    fail_if(drop, "drop_held", **drop)
    return "none"


def record_gates(board: BoardUnderTest) -> str:
    """See that no gate changes while nothing moves, and whether the mains do it if one does."""
    hz, times = board.identity.tick_hz, dict[int, list[float]]()
    for edge in _record(board).edges:
        if edge.blocked:
            times.setdefault(edge.channel, []).append(edge.tick / hz)
    ripples = {gate: mains_ripple(times[gate]) for gate in sorted(times)}
    gates = "; ".join(
        f"gate {gate} {len(times[gate])} times" + (f", in step with {hz} Hz" if hz else "")
        for gate, hz in ripples.items()
    )
    code = "gates_flicker_mains" if any(ripples.values()) else "gates_flicker"
    fail_if(gates, code, gates_listed=f"{gates} within {_WATCH_S:g} s")
    return f"none within {_WATCH_S:g} s"


def _record(board: BoardUnderTest) -> RecordedDrop:
    """Record all gates that are not blocked, with all releases off.

    A board fires only when all its gates are clear and keep still. One that flickers with the
    mains does so for some milliseconds between two pulses, so a few tries in a row get there.
    """
    clear = ((1 << board.identity.gates) - 1) & ~board.gates.always
    need(clear, "a gate that is clear")
    board.settle()
    order = board.order(gates=clear, record_ms=round(_WATCH_S * 1000))
    for _ in range(_TRIES):
        try:
            board.fire(board.arm(order))
        except DeviceRefusedError as refused:
            if refused.reason not in _AGAIN:
                raise
        else:
            return board.collect_drop()
    raise rig_error("gates_flicker", gates_listed="too often to begin a recording")


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


BOARD_CHECKS: Mapping[str, Check] = {
    "board": checks.identify,
    "firmware": check_firmware,
    "held drop": check_held_drop,
    "round trips": line_checks.measure_round_trips,
    "gates": checks.look_at_gates,
    "stop and flickering gates": record_gates,
}
