"""The operator's commands: what each action of the table does."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Any

from rig.campaign.events import Again, GoOn, Note, Reject, Restore, Stage, Stopped, Try, Warned
from rig.campaign.plan import again
from rig.errors import RigError
from rig.reasons import notes_in
from rig.tui import selectors
from rig.tui.screens.ask import Ask, AskReason, Confirm
from rig.tui.screens.help import Help
from rig.tui.screens.palette import Palette
from rig.tui.writing import export_of, report_of, write

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine
    from pathlib import Path

    from rig.tui.client import ReconnectingClient
    from rig.tui.context import CommandContext


REASONS = (
    "a chain was touched, or not at rest",
    "hung otherwise than told",
    "the incline was not as told",
    "a knock or a draught at the rig",
    "a chain caught on something",
    "a try, not meant to count",
)
"""Why drops are rejected that are good by their limits, as far as nobody types another reason."""


def do(app: CommandContext, name: str) -> None:
    """Do one action of the table; whether it makes sense now was asked before.

    At once: what comes of a key depends on what is there when the key is handled. Only what waits
    for the daemon or for files goes on beside the screens, and none of that arms.
    """
    if name.startswith("page_"):
        app.turn(name.removeprefix("page_"))
    else:
        _DO[name](app)


def _go_on(app: CommandContext) -> None:
    """Take the next step of the flow, but never arm: see `rig.tui.app.RigApp.arm`."""
    stage = app.driver.flow.stage
    if stage is Stage.PREPARE and app.page == "run":
        app.driver.take(Warned("the release is armed by the Enter key, not from here\n"
                               "half a second after anything else"))  # fmt: skip
    elif stage is Stage.PREPARE:
        app.turn("run")
    elif stage is not Stage.PROTOCOL:
        app.driver.take(GoOn(selectors.next_job(app.model)))
    else:
        page = app.protocols
        if page.file is not None and page.usable and page.session is not None:
            files = str(page.file.resolve()), str(page.session.resolve())
            app.begin(app.driver.open_session(*files, app.options.seed))


def _control(app: CommandContext) -> None:
    """Take control, or ask whether to give it back; who has it instead is said."""
    client = app.client
    assert client is not None
    if client.driving:
        question = "Another screen can take it then; this one goes on watching."
        _confirm(app, "CONTROL OF THE RIG", question, "give it back",
                 lambda: app.begin(_quietly(client.release_control())))  # fmt: skip
    else:
        app.begin(_take_control(app))


async def _take_control(app: CommandContext) -> None:
    assert app.client is not None
    try:
        await app.client.take_control()
    except RigError as error:
        app.driver.refuse(error)


async def _quietly(work: Coroutine[Any, Any, Any]) -> None:
    """Wait for what the daemon itself says when it fails."""
    with suppress(RigError):
        await work


def _close(app: CommandContext) -> None:
    """Ask, then close the session, so that another can be chosen."""
    client = app.client
    assert client is not None

    def close() -> None:
        app.driver.asked = None
        app.begin(_quietly(client.call("close_session")))

    question = "What is recorded stays in its file, and can be continued."
    _confirm(app, "CLOSE THE SESSION", question, "close it", close)


def _quit(app: CommandContext) -> None:
    """Ask, then leave."""
    question = "What is armed or falls goes on without this screen." if app.client else ""
    _confirm(app, "LEAVE", question, "leave", app.exit)


def _confirm(
    app: CommandContext, title: str, question: str, yes: str, act: Callable[[], object]
) -> None:
    def answered(meant: bool | None) -> None:
        if meant:
            act()

    app.ask(Confirm(title, question, yes), answered)


def _try_release(app: CommandContext) -> None:
    """Ask, then drive the release once."""
    app.turn("device")
    view = app.model.view
    if view is None:
        return
    pulse_ms = view.protocol.release.pulse * 1e3
    question = (
        f"The release is driven once, for {pulse_ms:g} ms. Take the chains off: what hangs there "
        "falls. It is no run of the plan, and nothing of it is counted."
    )
    _confirm(app, "TEST OF THE RELEASE", question, "drive it", lambda: app.driver.take(Try()))


def _sessions(app: CommandContext) -> None:
    """Let another session be chosen."""
    from rig.tui import picking  # noqa: PLC0415 - brings the analysis along

    app.begin(picking.sessions(app))


def _drops(app: CommandContext) -> None:
    """Let another drop be chosen."""
    from rig.tui import picking  # noqa: PLC0415 - brings the analysis along

    picking.drops(app)


def _note(app: CommandContext) -> None:
    def given(text: str | None) -> None:
        if text is not None:
            app.driver.take(Note(text))

    app.ask(Ask("Note on this drop:", " · ".join(notes_in(app.driver.flow.reasons))), given)


def _filter(app: CommandContext) -> None:
    """Ask which drops are looked at."""
    from rig.tui.choosing import HOW  # noqa: PLC0415 - brings the analysis along

    def given(words: str | None) -> None:
        if words is not None:
            app.history.sift(words.strip())

    app.turn("history")
    app.ask(Ask(HOW, app.history.words), given)


def _compare(app: CommandContext) -> None:
    """Lay drops over each other, or show one alone."""
    app.turn("history")
    app.history.compare()


def _write(app: CommandContext, command: Callable[[Path], tuple[str, ...]]) -> None:
    """Ask, then have files written of the session that is looked at."""
    view = (app.history.view if app.page == "history" else None) or app.model.view
    if view is None:
        app.tell(app.model.loading or "no session is open: o lists them")
        return
    words = command(view.path)
    _confirm(app, "WRITE FILES", f"{words[-1]}: what is there is replaced.", "write them",
             lambda: app.begin(write(app, *words)))  # fmt: skip


def _step(app: CommandContext, by: int) -> None:
    """Go a step in time, or with the cursor where nothing is played."""
    if app.page == "history":
        app.history.turn(by)
    else:
        app.pages[app.page].point(by)


def _reject(app: CommandContext) -> None:
    """Ask why the drop is rejected; or whether a rejection is taken back."""
    model = app.model
    if model.flow.verdict == "rejected":
        verdict, _ = model.flow.judged
        question = f"The drop is {verdict} then, as it was by its limits. Both stay in the log."
        _confirm(app, "TAKE THE REJECTION BACK", question, "take it back",
                 lambda: app.driver.take(Restore()))  # fmt: skip
        return

    def given(reason: str | None) -> None:
        if reason:
            app.driver.take(Reject(reason))

    question = "Why is this drop rejected?"
    if model.replaced is not None:
        question += (
            f" Attempt {model.replaced.attempt} was good, but of a run only the latest attempt "
            "counts: it has no result then, until it is repeated."
        )
    app.ask(AskReason(question, REASONS), given)


def _repeat(app: CommandContext) -> None:
    """Ask, then go back to a run for another attempt."""
    model = app.model
    job = model.flow.job or model.job
    wanted = again(selectors.runs(model), job.run) if job else None
    if wanted is not None:
        title = f"RUN {wanted.run}, ATTEMPT {wanted.attempt}"
        question = "It is prepared next, and nothing is armed yet."
        if selectors.good(model, wanted.run):
            question += " The run has a good drop; from now on the new one counts instead of it."
        _confirm(app, title, question, "prepare it", lambda: app.driver.take(Again(wanted)))


def _unblind(app: CommandContext) -> None:
    """Ask, then have it recorded that the numbers may be seen."""
    client = app.client
    assert client is not None
    if not app.model.blind:
        app.driver.take(Warned("this session is not blind\nblind: true in a protocol makes it so"))
        return
    question = "What was measured is shown from now on. This is recorded, and cannot be undone."
    _confirm(app, "UNBLIND THE SESSION", question, "show the numbers",
             lambda: app.begin(_unblinded(app, client)))  # fmt: skip


async def _unblinded(app: CommandContext, client: ReconnectingClient) -> None:
    try:
        await client.call("unblind")
    except RigError as error:
        app.driver.refuse(error)
    else:
        await app.follower.read()


def _begin_check(app: CommandContext) -> None:
    app.follower.indicators = app.follower.indicators.reset()


_DO: dict[str, Callable[[CommandContext], object]] = {
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
    "palette": lambda app: app.ask(Palette(app.choices()), app.action_do),
    "quit": _quit,
    "go_on": _go_on,
    "control": _control,
    "close": _close,
    "release_test": _try_release,
    "sessions": _sessions,
    "drops": _drops,
    "play": lambda app: app.history.play(),
    "turn_round": lambda app: app.history.turn_round(),
    "earlier": lambda app: _step(app, -1),
    "later": lambda app: _step(app, 1),
    "filter": _filter,
    "compare": _compare,
    "report": lambda app: _write(app, report_of),
    "export": lambda app: _write(app, export_of),
    "slower": lambda app: app.history.pace(0.5),
    "faster": lambda app: app.history.pace(2.0),
}
