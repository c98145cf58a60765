"""The operator's commands: what each action of the table does."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from rig.analysis.result import GOOD
from rig.campaign.events import Again, GoOn, Note, Reject, Restore, Stage, Stopped, Try, Warned
from rig.campaign.plan import again
from rig.errors import RigError
from rig.reasons import notes_in
from rig.tui import picking
from rig.tui.choosing import labels
from rig.tui.replay import Player
from rig.tui.screens.dialogs import Ask, AskReason, Confirm, Palette
from rig.tui.screens.help import Help
from rig.tui.widgets.text import plain
from rig.tui.writing import write

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine

    from rig.tui.app import RigApp
    from rig.tui.client import ReconnectingClient


REASONS = (
    "touched, or not at rest, before the release",
    "not set up as the run page shows",
    "a knock or a draught at the rig",
    "caught on something",
    "a trial that should not count",
)
"""Frequent reasons to reject a drop that is within its limits; the operator may type another."""


def do(app: RigApp, name: str) -> None:
    """Do one action of the table; whether it makes sense now was asked before.

    At once: what comes of a key depends on what is there when the key is handled. Only what waits
    for the daemon or for files goes on beside the screens, and none of that arms.
    """
    if name.startswith("page_"):
        app.turn(name.removeprefix("page_"))
    else:
        _DO[name](app)


def _go_on(app: RigApp) -> None:
    """Take the next step of the flow, but never arm: see `rig.tui.app.RigApp.arm`."""
    stage = app.driver.flow.stage
    if stage is Stage.PREPARE and app.page == "run":
        app.driver.take(Warned("only the Enter key arms the release\n"
                               "press it half a second after any other key"))  # fmt: skip
    elif stage is Stage.PREPARE:
        app.turn("run")
    elif stage is not Stage.PROTOCOL:
        app.driver.take(GoOn(app.model.next_job))
    else:
        page = app.protocols
        if page.file is not None and page.usable and app.options.session is not None:
            files = str(page.file.resolve()), str(app.options.session.resolve())
            app.begin(app.driver.open_session(*files, app.options.seed))


def _control(app: RigApp) -> None:
    """Take control, or ask whether to give it back; who has it instead is said."""
    client = app.client
    assert client is not None
    if client.driving:
        question = "Another screen can then take it; this screen keeps watching."
        _confirm(app, "Give control back?", question, "give it back",
                 lambda: app.begin(_quietly(client.release_control())))  # fmt: skip
    else:
        app.begin(_tried(app, client.take_control()))


async def _tried(app: RigApp, work: Coroutine[Any, Any, Any]) -> None:
    """Wait for what the daemon does, and say what is wrong when it fails."""
    try:
        await work
    except RigError as error:
        app.driver.refuse(error)


async def _quietly(work: Coroutine[Any, Any, Any]) -> None:
    """Wait for what the daemon itself says when it fails."""
    with suppress(RigError):
        await work


def _close(app: RigApp) -> None:
    """Ask, then close the session, so that another can be chosen."""
    client = app.client
    assert client is not None

    def close() -> None:
        app.driver.asked = None
        app.begin(_quietly(client.call("close_session")))

    question = "Everything recorded stays in its file. You can continue it later."
    _confirm(app, "Close the session?", question, "close", close)


def _quit(app: RigApp) -> None:
    """Ask, then leave."""
    question = "The rig keeps running after you quit." if app.client else ""
    _confirm(app, "Quit?", question, "quit", app.exit)


def _confirm(app: RigApp, title: str, question: str, yes: str, act: Callable[[], object]) -> None:
    app.ask(Confirm(title, question, yes), lambda _: act())


def _try_release(app: RigApp) -> None:
    """Ask, then drive the release once."""
    app.turn("device")
    view = app.model.view
    if view is None:
        return
    pulse_ms = view.protocol.release.pulse * 1e3
    question = (
        f"This drives the release once, for {pulse_ms:g} ms. Take {view.protocol.vocabulary.body} "
        "off first. The test is not a run of the plan and is not counted."
    )
    _confirm(app, "Test the release?", question, "test", lambda: app.driver.take(Try()))


def _note(app: RigApp) -> None:
    text = " · ".join(notes_in(app.driver.flow.reasons))
    app.ask(Ask("Note on this drop:", text), lambda text: app.driver.take(Note(text)))


def _filter(app: RigApp) -> None:
    """Ask which drops are looked at."""
    app.turn("history")
    view = app.history.view
    words = dict.fromkeys(word for drop in labels(view).values() for word in drop) if view else ()
    question = f"Show drops with all of these words: {plain(' '.join(words))}"
    app.ask(Ask(question, app.history.words), lambda words: app.history.sift(words.strip()))


def _compare(app: RigApp) -> None:
    """Lay drops over each other, or show one alone."""
    app.turn("history")
    app.history.comparing = not app.history.comparing


def _write(app: RigApp, command: str, option: str, suffix: str) -> None:
    """Ask, then have a command write files of the session that is looked at, beside it."""
    view = (app.history.view if app.page == "history" else None) or app.model.view
    if view is None:
        app.tell(app.model.loading or "no session is open: press o to choose one")
        return
    target = str(view.path.with_suffix(suffix))
    _confirm(app, "Write files?", f"{target} will be replaced if it exists.", "write",
             lambda: app.begin(write(app, command, str(view.path), option, target)))  # fmt: skip


def _step(app: RigApp, by: int) -> None:
    """Go a step in time, or with the cursor where nothing is played."""
    if app.page == "history":
        app.history.change(lambda tape, end_s: tape.moved(by, end_s))
    else:
        app.pages[app.page].point(by)


def _reject(app: RigApp) -> None:
    """Ask why the drop is rejected; or whether a rejection is taken back."""
    model = app.model
    if model.flow.verdict == "rejected":
        verdict, _ = model.flow.judged
        question = f"The drop becomes {verdict} again. The log keeps both verdicts."
        _confirm(app, "Undo the rejection?", question, "undo",
                 lambda: app.driver.take(Restore()))  # fmt: skip
        return

    question = "Why is this drop rejected?"
    if model.replaced is not None:
        question += (
            f" Only the latest attempt of a run counts: attempt {model.replaced.attempt} was good, "
            "but the run will have no result until you repeat it."
        )
    app.ask(AskReason(question, REASONS), lambda reason: app.driver.take(Reject(reason)))


def _repeat(app: RigApp) -> None:
    """Ask, then go back to a run for another attempt."""
    model = app.model
    job = model.flow.job or model.job
    next_run = again(model.runs, job.run) if job else None
    if next_run is not None:
        title = f"Repeat run {next_run.run} (attempt {next_run.attempt})?"
        question = "This only prepares the run; nothing is armed yet."
        if any(line.run == next_run.run and line.state in GOOD for line in model.runs):
            question += " The run has a good drop; the new attempt will count instead."
        _confirm(app, title, question, "prepare", lambda: app.driver.take(Again(next_run)))


def _unblind(app: RigApp) -> None:
    """Ask, then have it recorded that the numbers may be seen."""
    client = app.client
    assert client is not None
    if not app.model.blind:
        app.driver.take(Warned("this session is not blind\nwrite blind: true in its protocol"))
        return
    question = "This shows all results. It is recorded and cannot be undone."
    _confirm(app, "Unblind the session?", question, "show results",
             lambda: app.begin(_tried(app, _unblinded(app, client))))  # fmt: skip


async def _unblinded(app: RigApp, client: ReconnectingClient) -> None:
    await client.call("unblind")
    await app.follower.read()


def _begin_check(app: RigApp) -> None:
    app.follower.indicators = app.follower.indicators.reset()


_DO: dict[str, Callable[[RigApp], object]] = {
    "stop": lambda app: app.driver.take(Stopped()),
    "reject": _reject,
    "note": _note,
    "again": _repeat,
    "unblind": _unblind,
    "wave": _begin_check,
    "control_chart": lambda app: app.pages[app.page].other_chart(),
    "previous": lambda app: app.pages[app.page].move(-1),
    "next": lambda app: app.pages[app.page].move(1),
    "theme": lambda app: app.next_theme(),
    "help": lambda app: app.ask(Help(app.page, app.keys)),
    "palette": lambda app: app.ask(Palette(app.keys, app.hindrance), app.action_do),
    "quit": _quit,
    "go_on": _go_on,
    "control": _control,
    "close": _close,
    "release_test": _try_release,
    "sessions": lambda app: app.begin(picking.sessions(app)),
    "drops": picking.drops,
    "play": lambda app: app.history.change(Player.started),
    "turn_round": lambda app: app.history.change(lambda tape, _: replace(tape, back=not tape.back)),
    "earlier": lambda app: _step(app, -1),
    "later": lambda app: _step(app, 1),
    "filter": _filter,
    "compare": _compare,
    "report": lambda app: _write(app, "report", "-o", ".html"),
    "export": lambda app: _write(app, "export", "--csv", ".csv"),
    "slower": lambda app: app.history.change(lambda tape, _: tape.turned(0.5)),
    "faster": lambda app: app.history.change(lambda tape, _: tape.turned(2.0)),
}
