"""The operator's commands: what each action of the table does."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING

from rig.campaign.events import Again, GoOn, Note, Reject, Stage, Stopped, Try
from rig.campaign.plan import again
from rig.errors import RigError
from rig.tui import selectors
from rig.tui.actions import shown_key
from rig.tui.screens.ask import Ask, Confirm
from rig.tui.screens.help import Help

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from rig.tui.context import CommandContext


async def do(app: CommandContext, name: str) -> None:
    """Do one action of the table; whether it makes sense now was asked before."""
    if name.startswith("page_"):
        await app.go(name.removeprefix("page_"))
        return
    if name == "quit":
        app.exit()
        return
    if name in _HISTORY:
        _HISTORY[name](app)
    elif name in _SIMPLE:
        _SIMPLE[name](app)
    else:
        with suppress(RigError):
            await _SLOW[name](app)


async def _go_on(app: CommandContext) -> None:
    """Take the next step of the flow."""
    if app.driver.flow.stage is not Stage.PROTOCOL:
        model = app.model
        app.driver.take(GoOn(selectors.next_job(model), model.settle_s))
        return
    page = app.protocols
    if page.file is not None and page.usable and page.session is not None:
        files = str(page.file.resolve()), str(page.session.resolve())
        await app.driver.open_session(*files, app.options.seed)


async def _control(app: CommandContext) -> None:
    """Take control, or give it back; who has it instead is said."""
    client = app.client
    assert client is not None
    if client.driving:
        await client.release_control()
        return
    try:
        await client.take_control()
    except RigError as error:
        app.driver.refuse(error)


async def _close(app: CommandContext) -> None:
    """Close the session, so that another can be chosen."""
    assert app.client is not None
    app.driver.asked = None
    await app.client.call("close_session")


async def _try_release(app: CommandContext) -> None:
    """Ask, then drive the release once."""
    await app.go("device")
    view = app.model.view
    if view is None:
        return
    pulse_ms = view.protocol.release.pulse * 1e3
    question = (
        f"The release is driven once, for {pulse_ms:g} ms. Take the chains off: what hangs there "
        "falls. It is no run of the plan, and nothing of it is counted."
    )

    def answered(yes: bool | None) -> None:
        if yes:
            app.driver.take(Try())

    confirm = Confirm("TEST OF THE RELEASE", question, "drive it", _stop_key(app))
    app.ask(confirm, answered)


async def _sessions(app: CommandContext) -> None:
    """Let another session be chosen."""
    from rig.tui import picking  # noqa: PLC0415 - brings the analysis along

    await picking.sessions(app)


async def _drops(app: CommandContext) -> None:
    """Let another drop be chosen."""
    from rig.tui import picking  # noqa: PLC0415 - brings the analysis along

    picking.drops(app)


def _ask(app: CommandContext, question: str, answer: type[Reject | Note]) -> None:
    def given(text: str | None) -> None:
        if text:
            app.driver.take(answer(text))

    app.ask(Ask(question, _stop_key(app)), given)


def _stop_key(app: CommandContext) -> str:
    return shown_key(app.keys["stop"])


def _repeat(app: CommandContext) -> None:
    """Go back to a run for another attempt."""
    model = app.model
    job = model.flow.job or model.job
    wanted = again(selectors.runs(model), job.run) if job else None
    if wanted is not None:
        app.driver.take(Again(wanted))


def _toggle_blind(app: CommandContext) -> None:
    flow = app.driver.flow
    app.driver.flow = replace(flow, blind=not flow.blind)


def _begin_check(app: CommandContext) -> None:
    app.follower.indicators = app.follower.indicators.reset()


_SIMPLE: dict[str, Callable[[CommandContext], object]] = {
    "stop": lambda app: app.driver.take(Stopped()),
    "reject": lambda app: _ask(app, "Why is this drop rejected?", Reject),
    "note": lambda app: _ask(app, "Note on this drop:", Note),
    "again": _repeat,
    "blind": _toggle_blind,
    "wave": _begin_check,
    "control_chart": lambda app: app.pages[app.page].other_chart(),
    "previous": lambda app: app.pages[app.page].move(-1),
    "next": lambda app: app.pages[app.page].move(1),
    "theme": lambda app: app.next_theme(),
    "help": lambda app: app.ask(Help(app.page, app.keys)),
    "palette": lambda app: app.action_command_palette(),
}
_SLOW: dict[str, Callable[[CommandContext], Awaitable[None]]] = {
    "go_on": _go_on,
    "control": _control,
    "close": _close,
    "release_test": _try_release,
    "sessions": _sessions,
    "drops": _drops,
}
_HISTORY: dict[str, Callable[[CommandContext], object]] = {
    "play": lambda app: app.history.play(),
    "turn_round": lambda app: app.history.turn_round(),
    "earlier": lambda app: app.history.turn(-1),
    "later": lambda app: app.history.turn(1),
    "slower": lambda app: app.history.pace(0.5),
    "faster": lambda app: app.history.pace(2.0),
}
