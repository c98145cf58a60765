"""Checks of who is there, and of every request that fires nothing, good and bad."""

from __future__ import annotations

from dataclasses import replace

from rig.boards import GATES, RELEASES
from rig.link import messages as wire
from rig.link.client import BOOT_WAIT_S
from rig.link.frames import DELIMITER
from rig.link.gatewatch import name_gates
from rig.link.messages import PROTOCOL_VERSION, Phase, RefusalReason
from rig.selftest.board import LABEL, PULSE_US, BoardUnderTest, RawRequest
from rig.selftest.findings import NotPossibleError, fail_if, insist, need, wrong_answer

BAD_ORDERS: tuple[dict[str, int], ...] = (
    {"label": 0},
    {"gates": 0},
    {"release": 0x80},
    {"release": 0},
    {"pulse_us": 0},
    {"pulse_us": 2**32 - 1},
    {"timeout_ms": 0},
    {"record_ms": 0},
)
"""Each makes an ARM that pulses a release one that no device may accept."""

_UNKNOWN_CODES = (0x55, 0x00, 0x82, 0xFF)
"""Types that are no requests."""


def identify(board: BoardUnderTest) -> str:
    """See that the board introduces itself, sensibly and twice alike."""
    board.write(DELIMITER)
    board.wait_unasked(BOOT_WAIT_S, wire.Boot)
    identity = board.answer(wire.Identify(), wire.Identity)
    faults = {
        "no name": not (identity.board and identity.firmware),
        "no id": not any(identity.unique_id),
        "no gates": not identity.gates,
        "gates without a name": len(identity.channels.split()) != identity.gates,
        "no release": not identity.releases,
        "an impossible tick rate": identity.tick_hz < 1_000_000,
        "hardly any memory": identity.capacity < 100,
    }
    if any(faults.values()):
        answer = ", ".join(fault for fault, present in faults.items() if present)
        raise wrong_answer("Identify", "a complete identity", answer)
    insist("a second Identify", board.answer(wire.Identify(), wire.Identity), identity)
    return f"{identity.board}, {identity.firmware}, id {identity.unique_id.hex()}"


def ask_other_versions(board: BoardUnderTest) -> None:
    """See that clients of other versions are turned away."""
    for version in (0, PROTOCOL_VERSION + 1):
        board.refuse(wire.Identify(version), RefusalReason.VERSION, PROTOCOL_VERSION)


def ask_every_message(board: BoardUnderTest) -> None:
    """See that each request gets its own kind of answer; those about drops have their own tests."""
    board.answer(wire.Ping(), wire.Pong)
    board.state()
    board.answer(wire.Reference(), wire.ReferencePulse)
    board.need_idle()  # ABORT would let a held drop be discarded
    board.abort()


def send_unknown_messages(board: BoardUnderTest) -> None:
    """See that types that are no requests are refused."""
    for code in _UNKNOWN_CODES:
        board.refuse(RawRequest(code), RefusalReason.UNKNOWN_MESSAGE, code)


def send_other_lengths(board: BoardUnderTest) -> None:
    """See that every request with a byte too many, or one too few, is refused."""
    order = wire.Arm(1, 1, 0, 0, 1, 1)  # of the right length it would be accepted
    orders = order, wire.Fire(1), wire.Read(1, 0, 1), wire.Acknowledge(1, 0)
    examples: dict[type[wire.Message], wire.Message] = {type(each): each for each in orders}
    for code, kind in wire.TABLE.items():
        if code < 0x80 and kind is not wire.Flash:  # not every board knows it
            _, payload = wire.pack(examples.get(kind) or kind())
            for other in (payload + b"\1", payload[:-1]):
                if other != payload:  # nothing is one byte less than nothing
                    board.refuse(RawRequest(code, other), RefusalReason.BAD_PARAMETER, 0)


def look_at_gates(board: BoardUnderTest) -> str:
    """See that every gate in use is clear and keeps still."""
    states, fitted = board.gates, (1 << board.identity.gates) - 1
    in_use = board.options.gates
    counted = fitted if in_use is None else in_use
    faults = {
        "gates_not_fitted": counted & ~fitted,
        "gates_flicker": states.flickering & counted,
        "gates_blocked": states.stuck & (in_use or 0),
    }
    for code, mask in faults.items():
        fail_if(mask, code, gates_listed=name_gates(mask))
    stuck = name_gates(states.stuck)
    if in_use is None and states.stuck:
        raise NotPossibleError("gates_unused", gates_listed=stuck)
    unused = f"; not in use and blocked: {stuck}" if states.stuck else ""
    return f"{counted.bit_count()} gates clear{unused}"


def arm_blocked_gate(board: BoardUnderTest) -> str:
    """See that a gate that is blocked forbids arming."""
    stuck = board.gates.stuck
    need(stuck, "a gate that is blocked by hand")
    gate = stuck & -stuck
    order = board.order(gates=gate)
    if board.ask(order) == wire.Refused(RefusalReason.STOPPED, 0):
        raise NotPossibleError("refused_stopped")
    board.refuse(order, RefusalReason.GATE_BLOCKED, gate)
    return name_gates(gate)


def arm_and_abort(board: BoardUnderTest) -> None:
    """See that a board that was armed says so, and that ABORT disarms it."""
    token = board.arm()
    board.insist_state("Arm", phase=Phase.ARMED, label=LABEL, events=0)
    board.abort()
    board.insist_state("Abort", phase=Phase.IDLE)
    board.refuse(wire.Fire(token), RefusalReason.NOT_ARMED)


def fire_unarmed(board: BoardUnderTest) -> None:
    """See that FIRE alone does nothing."""
    board.need_idle()
    board.refuse(wire.Fire(1), RefusalReason.NOT_ARMED)


def send_wrong_tokens(board: BoardUnderTest) -> None:
    """See that a token which is not the latest does not fire."""
    old = board.arm()
    board.refuse(wire.Fire(old ^ 1), RefusalReason.WRONG_TOKEN)
    if board.arm() == old:
        raise wrong_answer("a second Arm", "another token", old)
    board.refuse(wire.Fire(old), RefusalReason.WRONG_TOKEN)


def send_bad_orders(board: BoardUnderTest) -> str:
    """See that no order is accepted that its table excludes, and that refusing changes nothing."""
    identity = board.identity
    variants = [*BAD_ORDERS, {"pulse_us": identity.max_pulse_us + 1}]
    if identity.gates < GATES:
        variants.append({"gates": 1 << identity.gates})
    if identity.releases < RELEASES:
        variants.append({"release": 1 << identity.releases})
    good = board.order(release=1, pulse_us=PULSE_US)  # if it were fired
    for changes in variants:
        name = "Arm with " + ", ".join(f"{name} {value}" for name, value in changes.items())
        board.refuse(replace(good, **changes), RefusalReason.BAD_PARAMETER, 0, name)
    board.settle()
    token = board.arm()
    board.refuse(board.order(gates=0), RefusalReason.BAD_PARAMETER)
    board.refuse(wire.Fire(token ^ 1), RefusalReason.WRONG_TOKEN)
    board.insist_state("a refused order", phase=Phase.ARMED)
    return f"{len(variants)} orders"


def read_no_drop(board: BoardUnderTest) -> None:
    """See that nothing is read or acknowledged while nothing is held."""
    board.need_idle()
    board.refuse(wire.Read(LABEL, 0, 1), RefusalReason.NO_SUCH_DROP)
    board.refuse(wire.Acknowledge(LABEL, 0), RefusalReason.NO_SUCH_DROP)
