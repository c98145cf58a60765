"""Checks of arming, of tokens, and of orders that must be refused. Nothing is fired."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from rig.link import messages as wire
from rig.link.messages import Phase, Reason
from rig.selftest.requests import BAD_ORDERS, beyond
from rig.selftest.stage import LABEL, insist_refused
from rig.selftest.verdicts import CheckFailedError

if TYPE_CHECKING:
    from rig.selftest.stage import Stage


def arm_and_abort(stage: Stage) -> str:
    """See that a board that was armed says so, and that ABORT disarms it."""
    token = stage.arm()
    state = stage.answer(wire.Status(), wire.State)
    if (state.phase, state.label, state.events) != (Phase.ARMED, LABEL, 0):
        raise CheckFailedError(f"armed, it says {state}")
    stage.answer(wire.Abort(), wire.Done)
    if stage.phase() is not Phase.IDLE:
        raise CheckFailedError("ABORT did not disarm it")
    stage.refused(wire.Fire(token), Reason.NOT_ARMED)
    return ""


def fire_unarmed(stage: Stage) -> str:
    """See that FIRE alone does nothing."""
    stage.refused(wire.Fire(1), Reason.NOT_ARMED)
    return ""


def wrong_tokens(stage: Stage) -> str:
    """See that a token which is not the latest does not fire."""
    old = stage.arm()
    stage.refused(wire.Fire(old ^ 1), Reason.WRONG_TOKEN)
    if stage.arm() == old:
        raise CheckFailedError("armed twice, it gives the same token")
    stage.refused(wire.Fire(old), Reason.WRONG_TOKEN)
    return ""


def bad_orders(stage: Stage) -> str:
    """See that no order is accepted that its table excludes, and that refusing changes nothing."""
    variants = [*BAD_ORDERS, *beyond(stage.known())]
    good = stage.releasing_order()
    for changes in variants:
        what = "Arm with " + ", ".join(f"{name} {value}" for name, value in changes.items())
        answer = stage.ask(replace(good, **changes))
        insist_refused(answer, what, Reason.BAD_PARAMETER, 0)
    stage.settle()
    token = stage.arm()
    stage.refused(stage.order(gates=0), Reason.BAD_PARAMETER)
    stage.refused(wire.Fire(token ^ 1), Reason.WRONG_TOKEN)
    if stage.phase() is not Phase.ARMED:
        raise CheckFailedError("a refused order disarmed it")
    return f"{len(variants)} orders"


def no_drop(stage: Stage) -> str:
    """See that nothing is read or acknowledged while nothing is held."""
    stage.refused(wire.Read(LABEL, 0, 1), Reason.NO_SUCH_DROP)
    stage.refused(wire.Acknowledge(LABEL, 0), Reason.NO_SUCH_DROP)
    return ""
