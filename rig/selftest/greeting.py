"""Checks of who is there, and of every request that needs no drop."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.link import messages as wire
from rig.link.client import BOOT_WAIT_S
from rig.link.frames import DELIMITER
from rig.link.gatewatch import listed
from rig.link.messages import PROTOCOL_VERSION, RefusalReason
from rig.selftest.board import insist_refused
from rig.selftest.requests import UNKNOWN_CODES, wrong_lengths
from rig.selftest.verdicts import CheckFailedError, NotPossibleError

if TYPE_CHECKING:
    from rig.selftest.board import BoardUnderTest


def handshake(board: BoardUnderTest) -> str:
    """See that the board introduces itself, sensibly and twice alike."""
    board.line.port.write(DELIMITER)
    board.unasked(BOOT_WAIT_S, wire.Boot)
    identity = board.answer(wire.Identify(), wire.Identity)
    board.identity = identity
    odd = [
        what
        for what, wrong in (
            ("no name", not (identity.board and identity.firmware)),
            ("no id", not any(identity.unique_id)),
            ("no gates", not identity.gates),
            ("gates without a name", len(identity.channels.split()) != identity.gates),
            ("no release", not identity.releases),
            ("an impossible tick rate", identity.tick_hz < 1_000_000),
            ("hardly any memory", identity.capacity < 100),
        )
        if wrong
    ]
    if odd:
        raise CheckFailedError(f"its IDENTITY has {', '.join(odd)}")
    if board.answer(wire.Identify(), wire.Identity) != identity:
        raise CheckFailedError("asked twice, it gives two different IDENTITYs")
    return f"{identity.board}, {identity.firmware}, id {identity.unique_id.hex()}"


def another_version(board: BoardUnderTest) -> str:
    """See that clients of other versions are turned away."""
    for version in (0, PROTOCOL_VERSION + 1):
        board.refused(wire.Identify(version), RefusalReason.VERSION, PROTOCOL_VERSION)
    return ""


def every_message(board: BoardUnderTest) -> str:
    """See that each request gets its own kind of answer; those about drops have their own tests."""
    board.answer(wire.Ping(), wire.Pong)
    board.answer(wire.Status(), wire.State)
    board.answer(wire.Reference(), wire.ReferencePulse)
    board.need_idle()  # ABORT would let a held drop be discarded
    board.answer(wire.Abort(), wire.Done)
    return ""


def unknown_messages(board: BoardUnderTest) -> str:
    """See that types that are no requests are refused."""
    for code in UNKNOWN_CODES:
        what = f"type 0x{code:02X}"
        answer = board.ask_raw(code, b"", what)
        insist_refused(answer, what, RefusalReason.UNKNOWN_MESSAGE, code)
    return ""


def other_lengths(board: BoardUnderTest) -> str:
    """See that a request that is too long or too short is refused."""
    for code, payload in wrong_lengths(wire.Arm(1, 1, 0, 0, 1, 1)):
        what = f"{wire.TABLE[code].__name__} of {len(payload)} bytes"
        insist_refused(board.ask_raw(code, payload, what), what, RefusalReason.BAD_PARAMETER, 0)
    return ""


def gates_now(board: BoardUnderTest) -> str:
    """See that every gate is clear and keeps still."""
    seen, count = board.gates(), board.known().gates
    faults = [
        f"{listed(mask)} {what}"
        for mask, what in (
            (seen.stuck, "blocked all the time"),
            (seen.flickering, "changing with nothing moving"),
        )
        if mask
    ]
    if faults:
        raise CheckFailedError(
            f"{'; '.join(faults)}: clear the beam, check its wires, and wire unused gates to ground"
        )
    return f"{count} gates clear"


def a_blocked_gate(board: BoardUnderTest) -> str:
    """See that a gate that is blocked forbids arming."""
    board.need_idle()
    stuck = board.gates().stuck
    if not stuck:
        raise NotPossibleError("no gate is blocked; block one by hand to see this")
    gate = stuck & -stuck
    answer = board.ask(board.order(gates=gate))
    if answer == wire.Refused(RefusalReason.STOPPED, 0):
        board.armed_by(answer)
    insist_refused(answer, "Arm", RefusalReason.GATE_BLOCKED, gate)
    return listed(gate)
