"""Checks of who is there, and of every request that needs no drop."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.link import messages as wire
from rig.link.client import BOOT_WAIT_S
from rig.link.frames import DELIMITER
from rig.link.gatewatch import listed
from rig.link.messages import PROTOCOL_VERSION, RefusalReason
from rig.selftest.findings import CheckFailedError, NotPossibleError, insist, insist_refusal
from rig.selftest.requests import UNKNOWN_CODES, wrong_lengths

if TYPE_CHECKING:
    from rig.selftest.board import BoardUnderTest


def identify(board: BoardUnderTest) -> str:
    """See that the board introduces itself, sensibly and twice alike."""
    board.line.port.write(DELIMITER)
    board.wait_unasked(BOOT_WAIT_S, wire.Boot)
    identity = board.answer(wire.Identify(), wire.Identity)
    board.identity = identity
    faults = [
        fault
        for fault, present in (
            ("no name", not (identity.board and identity.firmware)),
            ("no id", not any(identity.unique_id)),
            ("no gates", not identity.gates),
            ("gates without a name", len(identity.channels.split()) != identity.gates),
            ("no release", not identity.releases),
            ("an impossible tick rate", identity.tick_hz < 1_000_000),
            ("hardly any memory", identity.capacity < 100),
        )
        if present
    ]
    if faults:
        values = {"expected": "a complete identity", "answer": ", ".join(faults)}
        raise CheckFailedError("wrong_answer", request="Identify", **values)
    insist("a second Identify", board.answer(wire.Identify(), wire.Identity), identity)
    return f"{identity.board}, {identity.firmware}, id {identity.unique_id.hex()}"


def ask_other_versions(board: BoardUnderTest) -> str:
    """See that clients of other versions are turned away."""
    for version in (0, PROTOCOL_VERSION + 1):
        board.refuse(wire.Identify(version), RefusalReason.VERSION, PROTOCOL_VERSION)
    return ""


def ask_every_message(board: BoardUnderTest) -> str:
    """See that each request gets its own kind of answer; those about drops have their own tests."""
    board.answer(wire.Ping(), wire.Pong)
    board.answer(wire.Status(), wire.State)
    board.answer(wire.Reference(), wire.ReferencePulse)
    board.need_idle()  # ABORT would let a held drop be discarded
    board.answer(wire.Abort(), wire.Done)
    return ""


def send_unknown_messages(board: BoardUnderTest) -> str:
    """See that types that are no requests are refused."""
    for code in UNKNOWN_CODES:
        request = f"type 0x{code:02X}"
        answer = board.ask_raw(code, b"", request)
        insist_refusal(request, answer, RefusalReason.UNKNOWN_MESSAGE, code)
    return ""


def send_other_lengths(board: BoardUnderTest) -> str:
    """See that a request that is too long or too short is refused."""
    for code, payload in wrong_lengths(wire.Arm(1, 1, 0, 0, 1, 1)):
        request = f"{wire.TABLE[code].__name__} of {len(payload)} bytes"
        answer = board.ask_raw(code, payload, request)
        insist_refusal(request, answer, RefusalReason.BAD_PARAMETER, 0)
    return ""


def look_at_gates(board: BoardUnderTest) -> str:
    """See that every gate is clear and keeps still."""
    states = board.gates()
    if states.stuck:
        raise CheckFailedError("gates_blocked", gates_listed=listed(states.stuck))
    if states.flickering:
        raise CheckFailedError("gates_flicker", gates_listed=listed(states.flickering))
    return f"{board.known_identity().gates} gates clear"


def arm_blocked_gate(board: BoardUnderTest) -> str:
    """See that a gate that is blocked forbids arming."""
    board.need_idle()
    stuck = board.gates().stuck
    if not stuck:
        raise NotPossibleError("check_needs", needed="a gate that is blocked by hand")
    gate = stuck & -stuck
    answer = board.ask(board.order(gates=gate))
    if answer == wire.Refused(RefusalReason.STOPPED, 0):
        board.read_token(answer)
    insist_refusal("Arm", answer, RefusalReason.GATE_BLOCKED, gate)
    return listed(gate)
