"""Choosing from lists: a session of the folder, a drop of a session."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import TYPE_CHECKING

from textual.content import Content

from rig.campaign.events import refused
from rig.errors import RigError
from rig.results.live import LiveAnalysis
from rig.tui.actions import shown_key
from rig.tui.replay import Player
from rig.tui.screens.ask import Pick
from rig.tui.shelf import shelf
from rig.tui.widgets.banner import LOOKS
from rig.tui.words import plain

if TYPE_CHECKING:
    from rig.tui.app import RigApp
    from rig.tui.shelf import Volume


async def sessions(app: RigApp) -> None:
    """Let one session of the folder be chosen, and play it."""
    mine = app.view.path if app.view else app.options.session
    folder = mine.parent if mine else Path()
    volumes = await asyncio.to_thread(shelf, folder)
    await app.go("history")
    now = app.history.view.path if app.history.view else mine
    at = next((n for n, one in enumerate(volumes) if now and _same(one.path, now)), 0)

    def chosen(number: int | None) -> None:
        if number is not None and volumes:
            app.run_worker(_open(app, volumes[number]), group="actions")

    title = f"Sessions in {plain(folder.resolve(), 80)}, the newest first"
    app.push_screen(Pick(title, [_line(one) for one in volumes], at, _stop_key(app)), chosen)


def drops(app: RigApp) -> None:
    """Let one drop of the session that is played be chosen."""
    found, history = app.history.view, app.history
    if found is None:
        return
    hidden = app.flow.job if app.model.blindfold and history.other is None else None
    lines = []
    for job in found.jobs:
        verdict = "recorded" if job == hidden else found.results[job].verdict
        symbol, color = LOOKS.get(verdict, ("?", "$foreground"))
        run = found.plan[job.run]
        hung = f"{run.incline_deg:g}° impact {plain(run.impact, 20)}" if run.impact else "free fall"
        lines.append(
            Content.assemble(f"run {job.run:3}, attempt {job.attempt}   {hung:28}",
                             (f"{symbol} {verdict}", color))
        )  # fmt: skip

    def chosen(number: int | None) -> None:
        if number is not None:
            history.choose(number)

    app.push_screen(Pick("Drops of this session", lines, history.player.at, _stop_key(app)), chosen)


async def _open(app: RigApp, volume: Volume) -> None:
    history, live = app.history, app.view
    if live is not None and _same(live.path, volume.path):
        history.other = None
    else:
        try:
            history.other = await asyncio.to_thread(LiveAnalysis(volume.path).read)
        except RigError as error:
            app.event(refused(app.flow.ticket, error))
            return
    history.player = Player(speed=history.player.speed)


def _line(volume: Volume) -> Content:
    name = f"{plain(volume.path.name, 26):28}"
    if volume.trouble:
        return Content.assemble(name, ("✗ ", "bold $error"), plain(volume.trouble, 60))
    stamp = "▲ SIMULATED" if volume.simulated else ""
    return Content.assemble(
        name, f"{volume.created[:16].replace('T', ' '):18}{volume.drops:4} drops  ",
        (f"{stamp:13}", "bold $warning"), (plain(volume.title, 60), "$foreground 70%"),
    )  # fmt: skip


def _same(one: Path, other: Path) -> bool:
    return one.resolve() == other.resolve()


def _stop_key(app: RigApp) -> str:
    return shown_key(app.keys["stop"])
