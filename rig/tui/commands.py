"""Implementation of the operator's actions."""

from __future__ import annotations

import asyncio
import os
import signal
import sys
from asyncio.subprocess import DEVNULL, PIPE, STDOUT
from contextlib import suppress
from datetime import UTC, datetime
from functools import partial
from importlib import import_module
from itertools import count
from operator import methodcaller
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig.analysis.result import GOOD
from rig.campaign.machine import Again, GoOn, Note, Notice, Reject, Restore, Stage, StopRequest, Try
from rig.reasons import notes_in, rig_error
from rig.text_rows import read_rows
from rig.tui.actions import ACTIONS, PAGES, help_text, shown_key
from rig.tui.follow import open_live
from rig.tui.replay import Player
from rig.tui.widgets.dialogs import Ask, Confirm, TextDialog
from rig.tui.widgets.text import plain

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine

    from rig.tui.app import RigApp
    from rig.tui.beginnings import Beginning
    from rig.tui.survey import SessionEntry

    Work = Coroutine[Any, Any, object] | None
    """What an action leaves to do in the background."""

_QUESTIONS = {name: texts for name, *texts in read_rows(__file__, "questions.txt")}
REASONS = [reason for (reason,) in read_rows(__file__, "rejections.txt")]
"""Frequent reasons to reject a drop within its limits; the operator may type another."""
_FLASH = "flash", "--board"


def _go_on(app: RigApp) -> Work:
    """Take the next step of the flow, but never arm: see `rig.tui.app.RigApp._arm`."""
    stage = app.model.flow.stage
    if stage is Stage.PREPARE and app.model.page == "run":
        app.driver.take(Notice(rig_error("only_enter_arms").two_lines))
    elif stage is Stage.PREPARE:
        app.turn("run")
    elif stage is not Stage.PROTOCOL:
        app.driver.take(GoOn(app.model.next_job))
    elif app.model.page != "protocol":
        app.turn("protocol")
    elif (row := app.desk.chosen) is None:
        app.desk.opens_first = True
    else:
        return _BEGIN[row.kind](app, row)
    return None


# ------------------------------------------------------------------ home


def _open(app: RigApp, row: Beginning) -> Work:
    """Open an experiment with the connected rig, or in simulation without a rig."""
    client = app.client
    if row.file is None or app.desk.reading(row.file)[1]:
        app.tell("mend the file in an editor; it is read again by itself")
        return None
    session = row.session or app.options.session
    others = app.desk.opened not in {None, row.file}
    if session is None or (row.session is None and (others or row.kind == "try")):
        session = Path(f"{row.file.stem}-{datetime.now(UTC):%Y%m%dT%H%M%SZ}.session")
    app.desk.opened = row.file
    files = str(row.file.resolve()), str(session.resolve())
    if row.kind == "try" or client.idle or (row.value and not client.up):
        app.driver.asked = files
        return client.go_to("sim://", trial=True)
    return app.driver.open_session(*files, app.options.seed)


def _connect(app: RigApp, row: Beginning) -> None:
    """Switch to a board; ends a trial."""
    if row.value:
        app.driver.asked = None
        app.begin(app.client.go_to(row.value))
        app.tell("choose an experiment; then each gate is checked by hand")
    else:
        app.tell("plug the board in by USB; it appears here by itself")


def _new(app: RigApp, row: Beginning) -> Work:
    """Draft a protocol under an unused name."""
    names = (f"my-{row.value}{number or ''}.yaml" for number in count())
    name = next(name for name in names if not Path(name).exists())
    written = f"{name} is written: change what differs in your rig; then Enter opens it"
    return _run(app, "new", name, "--scene", row.value, "--yes", done=written)


def _end_other(app: RigApp, _: Beginning) -> None:
    """Ask, then end the daemon of another port."""
    client = app.client
    if client.in_the_way is None:
        return
    port, process = client.in_the_way

    def end() -> None:
        with suppress(ProcessLookupError):
            os.kill(process, signal.SIGTERM)

    _confirm(app, "end", end, port=plain(port, 40))


_BEGIN: dict[str, Callable[[RigApp, Beginning], Work]] = {
    "try": _open,
    "open": _open,
    "board": _connect,
    "flash": lambda app, row: _confirm(app, "flash", lambda: _run(app, *_FLASH, row.value)),
    "new": _new,
    "end": _end_other,
    "results": lambda app, _: _sessions(app),
}


def _control(app: RigApp) -> Work:
    """Take control, or ask whether to give it back."""
    if not app.client.driving:
        return app.client.take_control()
    _confirm(app, "control", app.client.release_control)
    return None


def _quit(app: RigApp) -> None:
    """Ask, then quit."""
    kind = " trial" if app.client.is_trial else " offline" if app.options.offline else ""
    _confirm(app, f"quit{kind}", app.exit)


def _confirm(app: RigApp, name: str, act: Callable[[], Work], **values: object) -> None:
    """Ask a question of the table, then act."""
    title, question, yes = (text.format(**values) for text in _QUESTIONS[name])
    app.ask(Confirm(title, question, yes), lambda _: act())


def _try_release(app: RigApp) -> None:
    """Ask, then drive the release once."""
    app.turn("device")
    protocol = app.model.protocol
    if protocol is not None:
        values = {"pulse_ms": protocol.release.pulse * 1e3, "body": protocol.vocabulary.body}
        _confirm(app, "release_test", lambda: app.driver.take(Try()), **values)


def _note(app: RigApp) -> None:
    text = " · ".join(notes_in(app.model.flow.reasons))
    app.ask(Ask("Note on this drop:", text), lambda text: app.driver.take(Note(text)))


# ------------------------------------------------------------------ history


async def _sessions(app: RigApp) -> None:
    """Let the operator choose a session of the folder, and play it."""
    view = app.desk.other or app.model.view
    own = view.path if view else app.options.session
    folder = own.parent if own else Path()
    survey = await asyncio.to_thread(import_module, "rig.tui.survey")
    entries = await asyncio.to_thread(survey.session_list, folder)
    app.turn("history")
    whole = (at for at, entry in enumerate(entries) if not entry.trouble)
    title = f"Sessions in {plain(folder.resolve(), 80)}, newest first"
    question = Ask(title, "", [*map(_session_line, entries)], yes="play", chosen=next(whole, 0))
    app.ask(question, lambda number: _look_at(app, entries[number]))


async def _look_at(app: RigApp, entry: SessionEntry) -> None:
    desk, live = app.desk, app.model.view
    own = live is not None and live.path.resolve() == entry.path.resolve()
    desk.other = None if own else await asyncio.to_thread(open_live(entry.path).read)
    desk.players["history"] = Player(speed=desk.players["history"].speed)


def _session_line(entry: SessionEntry) -> str:
    name, created = plain(entry.path.name, 26), entry.created[:16].replace("T", " ")
    if entry.trouble:
        return f"{name:28}✗ {plain(entry.trouble, 60)}"
    stamp = "▲ SIMULATED  " * entry.simulated
    return f"{name:28}{created}  {entry.drops:4} drops  {stamp}{plain(entry.title, 60)}"


def _move(app: RigApp, by: int) -> None:
    """Move in the list of a page, or scroll."""
    desk = app.desk
    if app.model.page == "history":
        desk.move(app.model, by)
    elif app.model.page == "protocol" and app.model.flow.stage is Stage.PROTOCOL and desk.rows:
        app.action_choose((desk.row + by) % len(desk.rows))
    else:
        app.sheet.scroll_tables(by)


def _change(work: Callable[[Player, float], Player]) -> Callable[[RigApp], Work]:
    return lambda app: app.desk.change(app.model, work)


# ------------------------------------------------------------------ a drop, files


def _write(app: RigApp, command: str, option: str, suffix: str) -> None:
    """Ask, then run a command that writes files of the shown session beside it."""
    view = (app.desk.other if app.model.page == "history" else None) or app.model.view
    if view is None:
        app.tell(app.model.loading or "no session is open: press o to choose one")
        return
    target = view.path.with_suffix(suffix)
    _confirm(app, "write", lambda: _run(app, command, view.path, option, target), target=target)


async def _run(app: RigApp, *command: str | Path, done: str = "") -> None:
    """Run a command, and show its result, its files, or its error.

    It runs in a separate process, so that its computations do not delay STOP.
    """
    app.tell(f"rig {command[0]}: working …")
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-m", "rig", *command, stdin=DEVNULL, stdout=PIPE, stderr=STDOUT
    )
    try:
        output, _ = await process.communicate()
    except asyncio.CancelledError:  # the app quits
        process.kill()
        await process.wait()
        raise
    lines = [line for line in output.decode("utf-8", "replace").splitlines() if line.strip()]
    if process.returncode == 0:
        lines = [done] if done else lines[-1:]
    app.tell("; ".join(lines[-2:]) or f"rig {command[0]} ended with {process.returncode}")


def _reject(app: RigApp) -> None:
    """Ask for the reason to reject a drop, or whether to undo a rejection."""
    model = app.model
    if model.flow.verdict == "rejected":
        _confirm(app, "undo", lambda: app.driver.take(Restore()), verdict=model.flow.judged[0])
        return

    question = "Why is this drop rejected?"
    if model.previous is not None:
        question += (
            f" Only the latest attempt of a run counts: attempt {model.previous.attempt} was good, "
            "but the run will have no result until you repeat it."
        )
    app.ask(Ask(question, choices=REASONS, yes="reject"), lambda why: app.driver.take(Reject(why)))


def _repeat(app: RigApp) -> None:
    """Ask, then go back to a run for another attempt."""
    model = app.model
    job = model.flow.job or model.job
    next_run = model.again(job.run) if job else None
    if next_run is not None:
        good = any(line.run == next_run.run and line.state in GOOD for line in model.runs)
        again = partial(app.driver.take, Again(next_run))
        _confirm(app, "repeat good" if good else "repeat", again, job=next_run)


def _unblind(app: RigApp) -> None:
    """Ask, then unblind the session."""
    if not app.model.blind:
        app.driver.take(Notice(rig_error("not_blind").two_lines))
        return
    _confirm(app, "unblind", lambda: app.client.connection.call("unblind"))


def _begin_check(app: RigApp) -> None:
    app.model.indicators = app.model.indicators.reset()


def _palette(app: RigApp) -> None:
    """Search the actions that are possible now."""
    actions = [each for each in ACTIONS if each.name != "palette" and app.model.allows(each)]
    lines = [f"{shown_key(app.keys[action.name]):8}{action.text}" for action in actions]
    question = Ask("Search commands", choices=lines, yes="run", chosen=0)
    app.ask(question, lambda number: app.action_do(actions[number].name))


DO: dict[str, Callable[[RigApp], Work]] = {
    "stop": lambda app: app.driver.take(StopRequest()),
    "reject": _reject,
    "note": _note,
    "again": _repeat,
    "unblind": _unblind,
    "wave": _begin_check,
    "part": lambda app: app.turn_on(part=1),
    "control_chart": lambda app: app.turn_on(chart=1),
    "previous": lambda app: _move(app, -1),
    "next": lambda app: _move(app, 1),
    "theme": lambda app: app.next_theme(),
    "help": lambda app: app.ask(TextDialog(help_text(app.keys, wide=app.size.width >= 120))),
    "palette": _palette,
    "quit": _quit,
    "go_on": _go_on,
    "control": _control,
    "close": lambda app: _confirm(app, "close", app.driver.close_session),
    "release_test": _try_release,
    "sessions": _sessions,
    "play": _change(Player.toggle_play),
    "earlier": _change(lambda player, end_s: player.step_time(-1, end_s)),
    "later": _change(lambda player, end_s: player.step_time(1, end_s)),
    "report": lambda app: _write(app, "report", "-o", ".html"),
    "export": lambda app: _write(app, "export", "--csv", ".csv"),
    "slower": _change(lambda player, _: player.change_speed(0.5)),
    "faster": _change(lambda player, _: player.change_speed(2.0)),
    **{f"page_{page}": methodcaller("turn", page) for page, *_ in PAGES},
}
"""Actions of the table, by name.

They run synchronously, as their effect depends on the state when the key is handled. Only work that
waits for the daemon or files, which they return, runs in the background, and none of that arms.
"""
