"""What the operator's actions do."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING

from rig.campaign.events import Again, GoOn, Note, Reject, Stage, Stopped, Try, refused
from rig.campaign.plan import again
from rig.errors import RigError
from rig.tui import seen, themes
from rig.tui.actions import shown_key
from rig.tui.screens.ask import Ask, Confirm
from rig.tui.screens.help import Help

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from rig.tui.app import RigApp


async def do(app: RigApp, name: str) -> None:
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


async def open_session(app: RigApp, protocol: str, session: str) -> None:
    """Have the daemon open a session, now and whenever it had to be started again."""
    assert app.client is not None
    try:
        await app.client.call(
            "open_session", protocol=protocol, session=session, seed=app.options.seed
        )
    except RigError as error:
        _refused(app, error)
    else:
        app.asked = protocol, session


async def _go_on(app: RigApp) -> None:
    """Take the next step of the flow."""
    if app.flow.stage is not Stage.PROTOCOL:
        app.event(GoOn(seen.next_job(app), seen.settle_s(app)))
        return
    page = app.protocols
    if page.file is not None and page.usable and page.session is not None:
        await open_session(app, str(page.file.resolve()), str(page.session.resolve()))


async def _control(app: RigApp) -> None:
    """Take control, or give it back; who has it instead is said."""
    client = app.client
    assert client is not None
    if client.driving:
        await client.release_control()
        return
    try:
        await client.take_control()
    except RigError as error:
        _refused(app, error)


async def _close(app: RigApp) -> None:
    """Close the session, so that another can be chosen."""
    assert app.client is not None
    app.asked = None
    await app.client.call("close_session")


async def _try_release(app: RigApp) -> None:
    """Ask, then drive the release once."""
    await app.go("device")
    view = app.view
    if view is None:
        return
    pulse_ms = view.protocol.release.pulse * 1e3
    question = (
        f"The release is driven once, for {pulse_ms:g} ms. Take the chains off: what hangs there "
        "falls. It is no run of the plan, and nothing of it is counted."
    )

    def answered(yes: bool | None) -> None:
        if yes:
            app.event(Try())

    confirm = Confirm("TEST OF THE RELEASE", question, "drive it", _stop_key(app))
    app.push_screen(confirm, answered)


async def _sessions(app: RigApp) -> None:
    """Let another session be chosen."""
    from rig.tui import picking  # noqa: PLC0415 - brings the analysis along

    await picking.sessions(app)


async def _drops(app: RigApp) -> None:
    """Let another drop be chosen."""
    from rig.tui import picking  # noqa: PLC0415 - brings the analysis along

    picking.drops(app)


def _refused(app: RigApp, error: RigError) -> None:
    app.event(refused(app.flow.ticket, error))


def _ask(app: RigApp, question: str, answer: type[Reject | Note]) -> None:
    def given(text: str | None) -> None:
        if text:
            app.event(answer(text))

    app.push_screen(Ask(question, _stop_key(app)), given)


def _stop_key(app: RigApp) -> str:
    return shown_key(app.keys["stop"])


def _repeat(app: RigApp) -> None:
    """Go back to a run for another attempt."""
    job = app.flow.job or seen.job(app)
    wanted = again(seen.runs(app), job.run) if job else None
    if wanted is not None:
        app.event(Again(wanted))


def _toggle_blind(app: RigApp) -> None:
    app.flow = replace(app.flow, blind=not app.flow.blind)


def _begin_check(app: RigApp) -> None:
    app.follower.indicators = app.indicators.reset()


def _next_theme(app: RigApp) -> None:
    app.theme = themes.after(app.theme)


_SIMPLE: dict[str, Callable[[RigApp], object]] = {
    "stop": lambda app: app.event(Stopped()),
    "reject": lambda app: _ask(app, "Why is this drop rejected?", Reject),
    "note": lambda app: _ask(app, "Note on this drop:", Note),
    "again": _repeat,
    "blind": _toggle_blind,
    "wave": _begin_check,
    "control_chart": lambda app: app.pages[app.page].other_chart(),
    "previous": lambda app: app.pages[app.page].move(-1),
    "next": lambda app: app.pages[app.page].move(1),
    "theme": _next_theme,
    "help": lambda app: app.push_screen(Help(app.page, app.keys)),
    "palette": lambda app: app.action_command_palette(),
}
_SLOW: dict[str, Callable[[RigApp], Awaitable[None]]] = {
    "go_on": _go_on,
    "control": _control,
    "close": _close,
    "release_test": _try_release,
    "sessions": _sessions,
    "drops": _drops,
}
_HISTORY: dict[str, Callable[[RigApp], object]] = {
    "play": lambda app: app.history.play(),
    "turn_round": lambda app: app.history.turn_round(),
    "earlier": lambda app: app.history.turn(-1),
    "later": lambda app: app.history.turn(1),
    "slower": lambda app: app.history.pace(0.5),
    "faster": lambda app: app.history.pace(2.0),
}
