"""Carrying out what the flow wants."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.campaign.events import (
    Answered,
    Arm,
    Collect,
    Drive,
    Fire,
    GiveUp,
    Judge,
    Judged,
    Log,
    Stop,
    Wait,
    refused,
)
from rig.errors import RigError

if TYPE_CHECKING:
    from rig.campaign.events import Effect
    from rig.tui.app import RigApp


async def carry_out(app: RigApp, effect: Effect, ticket: int) -> None:
    """Do what the flow wants and tell it what came of it."""
    wire = app.wire
    assert wire is not None
    token = None
    try:
        match effect:
            case GiveUp():
                return  # what is wrong is shown, and the operator goes on from there
            case Stop(reason):
                await wire.call("stop", reason=reason)
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
        app.event(refused(ticket, error))
    else:
        app.event(Answered(ticket, token))
