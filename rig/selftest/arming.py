"""Checks of arming, of tokens, and of orders that must be refused. Nothing is fired."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from rig.link import messages as wire
from rig.link.messages import Phase, RefusalReason
from rig.selftest.board import LABEL, insist_refused
from rig.selftest.requests import BAD_ORDERS, beyond
from rig.selftest.verdicts import CheckFailedError

if TYPE_CHECKING:
    from rig.selftest.board import BoardUnderTest


def arm_and_abort(board: BoardUnderTest) -> str:
    """See that a board that was armed says so, and that ABORT disarms it."""
    token = board.arm()
    state = board.answer(wire.Status(), wire.State)
    if (state.phase, state.label, state.events) != (Phase.ARMED, LABEL, 0):
        raise CheckFailedError(f"armed, it says {state}")
    board.answer(wire.Abort(), wire.Done)
    if board.phase() is not Phase.IDLE:
        raise CheckFailedError("ABORT did not disarm it")
    board.refused(wire.Fire(token), RefusalReason.NOT_ARMED)
    return ""


def fire_unarmed(board: BoardUnderTest) -> str:
    """See that FIRE alone does nothing."""
    board.refused(wire.Fire(1), RefusalReason.NOT_ARMED)
    return ""


def wrong_tokens(board: BoardUnderTest) -> str:
    """See that a token which is not the latest does not fire."""
    old = board.arm()
    board.refused(wire.Fire(old ^ 1), RefusalReason.WRONG_TOKEN)
    if board.arm() == old:
        raise CheckFailedError("armed twice, it gives the same token")
    board.refused(wire.Fire(old), RefusalReason.WRONG_TOKEN)
    return ""


def bad_orders(board: BoardUnderTest) -> str:
    """See that no order is accepted that its table excludes, and that refusing changes nothing."""
    variants = [*BAD_ORDERS, *beyond(board.known())]
    good = board.releasing_order()
    for changes in variants:
        what = "Arm with " + ", ".join(f"{name} {value}" for name, value in changes.items())
        answer = board.ask(replace(good, **changes))
        insist_refused(answer, what, RefusalReason.BAD_PARAMETER, 0)
    board.settle()
    token = board.arm()
    board.refused(board.order(gates=0), RefusalReason.BAD_PARAMETER)
    board.refused(wire.Fire(token ^ 1), RefusalReason.WRONG_TOKEN)
    if board.phase() is not Phase.ARMED:
        raise CheckFailedError("a refused order disarmed it")
    return f"{len(variants)} orders"


def no_drop(board: BoardUnderTest) -> str:
    """See that nothing is read or acknowledged while nothing is held."""
    board.refused(wire.Read(LABEL, 0, 1), RefusalReason.NO_SUCH_DROP)
    board.refused(wire.Acknowledge(LABEL, 0), RefusalReason.NO_SUCH_DROP)
    return ""
