"""Carrying out what the flow wants and what the operator asks for."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

from rig.errors import RigError
from rig.tui.flow import (
    Answered,
    Arm,
    Collect,
    Fire,
    Judge,
    Judged,
    Log,
    Refused,
    Stop,
    Stopped,
    Wait,
)

if TYPE_CHECKING:
    from rig.tui.app import RigApp
    from rig.tui.flow import Effect


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
            case Collect(job):
                await wire.call("collect", run=job.run, attempt=job.attempt)
            case Log(job, state, reasons):
                await wire.call(
                    "log_state", run=job.run, attempt=job.attempt, state=state,
                    reasons=list(reasons),
                )  # fmt: skip
            case Judge(job):
                result = (await app.read()).results[job]
                app.event(Judged(ticket, result.verdict, tuple(result.reasons)))
                return
    except RigError as error:
        app.event(Refused(ticket, f"{error.message}\n{error.hint}"))
    else:
        app.event(Answered(ticket, token))


async def do(app: RigApp, name: str) -> None:
    """Do one action of the table; whether it makes sense now was asked before."""
    if name.startswith("page_"):
        await app.go(name.removeprefix("page_"))
        return
    if name in {"control", "close"}:
        with suppress(RigError):
            await (_control(app) if name == "control" else app.close())
        return
    if name == "go_on":
        await app.go_on()
        return
    history = app.history
    player = history.player
    if name == "play":
        history.play(app.findings)
    elif name in {"earlier", "later"}:
        history.player = player.moved(1 if name == "later" else -1)
    elif name in {"slower", "faster"}:
        history.player = player.turned(2.0 if name == "faster" else 0.5)
    else:
        {
            "stop": lambda: app.event(Stopped()),
            "reject": app.ask_reject,
            "note": app.ask_note,
            "again": app.repeat,
            "blind": app.toggle_blind,
            "wave": app.begin_lamps,
            "previous": lambda: app.move(-1),
            "next": lambda: app.move(1),
            "theme": app.next_theme,
            "help": app.show_help,
            "palette": app.action_command_palette,
            "quit": app.exit,
        }[name]()


async def _control(app: RigApp) -> None:
    """Take control, or give it back; who has it instead is said."""
    wire = app.wire
    if wire is None:
        return
    if wire.driving:
        await wire.release_control()
        return
    try:
        await wire.take_control()
    except RigError as error:
        app.event(Refused(app.flow.ticket, f"{error.message}\n{error.hint}"))
