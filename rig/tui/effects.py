"""Carrying out what the flow wants."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.errors import RigError
from rig.tui.turns import (
    Answered,
    Arm,
    Collect,
    Drive,
    Fire,
    Judge,
    Judged,
    Log,
    Refused,
    Stop,
    Wait,
)

if TYPE_CHECKING:
    from rig.tui.app import RigApp
    from rig.tui.turns import Effect


async def carry_out(app: RigApp, effect: Effect, ticket: int) -> None:
    """Do what the flow wants and tell it what came of it."""
    wire = app.wire
    assert wire is not None
    token = None
    try:
        match effect:
            case Stop():
                await wire.call("stop", reason="stopped by the operator")
                return
            case Wait(seconds):
                await wire.call("wait", seconds=seconds)
            case Arm(job):
                answer = await wire.call("arm", run=job.run, attempt=job.attempt)
                token = int(answer["token"])
            case Fire(token_):
                await wire.call("fire", token=token_)
            case Drive():
                await wire.call("test_release")
            case Collect(job):
                await wire.call("collect", run=job.run, attempt=job.attempt)
            case Log(job, state, reasons):
                await wire.call(
                    "log_state", run=job.run, attempt=job.attempt, state=state,
                    reasons=list(reasons),
                )  # fmt: skip
            case Judge(job):
                result = (await app.follower.read()).results[job]
                app.event(Judged(ticket, result.verdict, tuple(result.reasons)))
                return
    except RigError as error:
        app.event(Refused(ticket, f"{error.message}\n{error.hint}"))
    else:
        app.event(Answered(ticket, token))
