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
    client = app.client
    assert client is not None
    token = None
    try:
        match effect:
            case GiveUp():
                return  # what is wrong is shown, and the operator goes on from there
            case Stop(reason):
                await client.call("stop", reason=reason)
                return
            case Wait(seconds):
                await client.call("wait", seconds=seconds)
            case Arm(job):
                answer = await client.call("arm", run=job.run, attempt=job.attempt)
                token = int(answer["token"])
            case Fire(token_):
                await client.call("fire", token=token_)
            case Drive():
                await client.call("test_release")
            case Collect(job):
                await client.call("collect", run=job.run, attempt=job.attempt)
            case Log(job, state, reasons):
                await client.call(
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
