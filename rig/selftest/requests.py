"""Checks of who is there, and of every request that fires nothing, good and bad."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from rig.boards import GATES, RELEASES
from rig.link import messages as wire
from rig.link.client import BOOT_WAIT_S
from rig.link.frames import DELIMITER
from rig.link.gatewatch import name_gates
from rig.link.messages import PROTOCOL_VERSION, Phase, RefusalReason
from rig.selftest.board import LABEL, PULSE_US, BoardUnderTest, RawRequest, Request
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


def _other_lengths() -> Iterator[RawRequest]:
    """Give every request with a byte too many, and with one too few."""
    order = wire.Arm(1, 1, 0, 0, 1, 1)  # of the right length it would be accepted
    orders = order, wire.Fire(1), wire.Read(1, 0, 1), wire.Acknowledge(1, 0)
    examples: dict[type[wire.Message], wire.Message] = {type(each): each for each in orders}
    for code, kind in wire.TABLE.items():
        if code < 0x80 and kind is not wire.Flash:  # not every board knows it
            _, payload = wire.pack(examples.get(kind) or kind())
            yield RawRequest(code, payload + b"\1")
            if payload:
                yield RawRequest(code, payload[:-1])


REFUSALS: dict[str, list[tuple[Request, int | None]]] = {
    "VERSION": [(wire.Identify(n), PROTOCOL_VERSION) for n in (0, PROTOCOL_VERSION + 1)],
    "UNKNOWN_MESSAGE": [(RawRequest(code), code) for code in (0x55, 0x00, 0x82, 0xFF)],
    "BAD_PARAMETER by length": [(request, 0) for request in _other_lengths()],
    "NOT_ARMED": [(wire.Fire(1), None)],
    "NO_SUCH_DROP": [(wire.Read(LABEL, 0, 1), None), (wire.Acknowledge(LABEL, 0), None)],
}
"""What a board that is idle refuses, with the detail where one is due; a name is the reason's."""


def refuse_row(name: str, board: BoardUnderTest) -> None:
    """See that a board refuses the requests of a row of `REFUSALS`."""
    for request, detail in REFUSALS[name]:
        board.refuse(request, RefusalReason[name.removesuffix(" by length")], detail)


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


def ask_every_message(board: BoardUnderTest) -> None:
    """See that each request gets its own kind of answer; those about drops have their own tests."""
    board.answer(wire.Ping(), wire.Pong)
    board.state()
    board.answer(wire.Reference(), wire.ReferencePulse)
    board.abort()


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
