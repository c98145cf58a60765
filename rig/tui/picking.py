"""Choosing from lists: a session of the folder, a drop of a session."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from textual.content import Content

from rig.errors import RigError
from rig.tui.choosing import condition, labels
from rig.tui.follow import open_live
from rig.tui.replay import Player
from rig.tui.screens.dialogs import Pick
from rig.tui.widgets.banner import LOOKS
from rig.tui.widgets.text import plain

if TYPE_CHECKING:
    from rig.tui.app import RigApp


_MOST = 200
"""Files that are listed, the newest."""


class SessionEntry(NamedTuple):
    """One session file; `trouble` says why it cannot be read."""

    path: Path
    title: str = ""
    created: str = ""
    drops: int = 0
    simulated: bool = False
    trouble: str = ""


def session_list(folder: Path) -> list[SessionEntry]:
    """List the sessions of a folder, the newest first."""
    dated = []
    for path in folder.glob("*.session"):
        try:
            dated.append((path.stat().st_mtime_ns, path))
        except OSError:
            continue  # gone meanwhile
    return [_look(path) for _, path in sorted(dated, reverse=True)[:_MOST]]


def _look(path: Path) -> SessionEntry:
    from rig.results import protocol_of  # noqa: PLC0415 - not needed to paint
    from rig.session.store import Session  # noqa: PLC0415 - nor is this

    try:
        with Session.open(path, readonly=True) as session:
            title = protocol_of(session).title
            drops = len({entry[:2] for entry in session.states() if entry.state == "recorded"})
            return SessionEntry(path, title, session.meta["created"], drops, session.simulated)
    except RigError as error:
        return SessionEntry(path, trouble=error.message)


async def sessions(app: RigApp) -> None:
    """Let one session of the folder be chosen, and play it."""
    view = app.model.view
    own = view.path if view else app.options.session
    folder = own.parent if own else Path()
    entries = await asyncio.to_thread(session_list, folder)
    app.turn("history")
    shown_path = app.history.view.path if app.history.view else own
    at = next(
        (n for n, entry in enumerate(entries) if shown_path and _same(entry.path, shown_path)), 0
    )

    title = f"Sessions in {plain(folder.resolve(), 80)}, newest first"
    question = Pick(title, [_line(entry) for entry in entries], at)
    app.ask(question, lambda number: app.begin(_open(app, entries[number])))


def drops(app: RigApp) -> None:
    """Let one drop of the session that is played be chosen."""
    view, history = app.history.view, app.history
    if view is None:
        return
    lines = []
    drop_labels = labels(view)
    for job in history.jobs:
        verdict = view.results[job].verdict
        symbol, color = LOOKS.get(verdict, ("?", "$foreground"))
        run = view.plan[job.run]
        lines.append(
            Content.assemble(f"run {job.run:3}, attempt {job.attempt}   {condition(run):28}",
                             (f"{symbol} {verdict:10}", color),
                             "counts" if "counts" in drop_labels[job] else "")
        )  # fmt: skip
    at = history.player.at % max(1, len(lines))
    app.ask(Pick("Drops of this session", lines, at), history.choose)


async def _open(app: RigApp, entry: SessionEntry) -> None:
    history, live = app.history, app.model.view
    if live is not None and _same(live.path, entry.path):
        history.other = None
    else:
        try:
            history.other = await asyncio.to_thread(open_live(entry.path).read)
        except RigError as error:
            app.driver.refuse(error)
            return
    history.player = Player(speed=history.player.speed)


def _line(entry: SessionEntry) -> Content:
    name = f"{plain(entry.path.name, 26):28}"
    if entry.trouble:
        return Content.assemble(name, ("✗ ", "bold $error"), plain(entry.trouble, 60))
    stamp = "▲ SIMULATED" if entry.simulated else ""
    return Content.assemble(
        name, f"{entry.created[:16].replace('T', ' '):18}{entry.drops:4} drops  ",
        (f"{stamp:13}", "bold $warning"), (plain(entry.title, 60), "$foreground 70%"),
    )  # fmt: skip


def _same(path: Path, second: Path) -> bool:
    return path.resolve() == second.resolve()
