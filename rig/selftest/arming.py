"""Checks of arming, of tokens, and of orders that must be refused. Nothing is fired."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from rig.link import messages as wire
from rig.link.messages import Phase, RefusalReason
from rig.selftest.board import LABEL
from rig.selftest.findings import insist, insist_refusal, wrong_answer
from rig.selftest.requests import BAD_ORDERS, beyond

if TYPE_CHECKING:
    from rig.selftest.board import BoardUnderTest


def arm_and_abort(board: BoardUnderTest) -> str:
    """See that a board that was armed says so, and that ABORT disarms it."""
    token = board.arm()
    state = board.answer(wire.Status(), wire.State)
    insist("Status when armed", state, replace(state, phase=Phase.ARMED, label=LABEL, events=0))
    board.answer(wire.Abort(), wire.Done)
    board.insist_phase(Phase.IDLE, "Abort")
    board.refuse(wire.Fire(token), RefusalReason.NOT_ARMED)
    return ""


def fire_unarmed(board: BoardUnderTest) -> str:
    """See that FIRE alone does nothing."""
    board.refuse(wire.Fire(1), RefusalReason.NOT_ARMED)
    return ""


def send_wrong_tokens(board: BoardUnderTest) -> str:
    """See that a token which is not the latest does not fire."""
    old = board.arm()
    board.refuse(wire.Fire(old ^ 1), RefusalReason.WRONG_TOKEN)
    if board.arm() == old:
        raise wrong_answer("a second Arm", "another token", old)
    board.refuse(wire.Fire(old), RefusalReason.WRONG_TOKEN)
    return ""


def send_bad_orders(board: BoardUnderTest) -> str:
    """See that no order is accepted that its table excludes, and that refusing changes nothing."""
    variants = [*BAD_ORDERS, *beyond(board.known_identity())]
    good = board.releasing_order()
    for changes in variants:
        request = "Arm with " + ", ".join(f"{name} {value}" for name, value in changes.items())
        answer = board.ask(replace(good, **changes))
        insist_refusal(request, answer, RefusalReason.BAD_PARAMETER, 0)
    board.settle()
    token = board.arm()
    board.refuse(board.order(gates=0), RefusalReason.BAD_PARAMETER)
    board.refuse(wire.Fire(token ^ 1), RefusalReason.WRONG_TOKEN)
    board.insist_phase(Phase.ARMED, "a refused order")
    return f"{len(variants)} orders"


def read_no_drop(board: BoardUnderTest) -> str:
    """See that nothing is read or acknowledged while nothing is held."""
    board.refuse(wire.Read(LABEL, 0, 1), RefusalReason.NO_SUCH_DROP)
    board.refuse(wire.Acknowledge(LABEL, 0), RefusalReason.NO_SUCH_DROP)
    return ""
