"""Follower of the daemon and the session file, which turns changes into state and events."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Iterator
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

from rig.campaign import machine as campaign
from rig.campaign.machine import BEFORE_RELEASE, Event, Stage
from rig.campaign.plan import job_to_judge
from rig.campaign.voids import Voids, voids_of
from rig.errors import RigError
from rig.reasons import rig_error
from rig.records import Job
from rig.tui.client import ReconnectingClient
from rig.tui.indicators import Indicators
from rig.tui.model import Model
from rig.tui.state import DaemonState, state_of

if TYPE_CHECKING:
    from rig.results.live import LiveAnalysis, SessionView

_CLOCK_S = 3.0
"""Time between readings of the file, as clock samples also arrive between drops, s."""


class Follower:
    """Keeps the model of the screens up to date with rig and session.

    Parameters
    ----------
    model
        Where the state is written.
    begin
        Runs a coroutine in the background.
    """

    def __init__(self, model: Model, begin: Callable[[Coroutine[Any, Any, None]], object]) -> None:
        self._model = model
        self._begin = begin
        self._path: Path | None = None
        self._reading = self._fitting = False
        self._wanted: object = None
        self._read: object = None
        self._counted: tuple[Job | None, int] = (None, 0)

    async def show_file(self, path: Path) -> None:
        """Show a file that has no writer."""
        self._forget(path)
        await self._read_quietly()
        model, view = self._model, self._model.view
        if view is not None:
            model.state, model.indicators = state_of(view), Indicators.of(view.channels)

    def look_with(self, live: LiveAnalysis) -> None:
        """Show a file with an existing live analysis."""
        self._path, self._model.live = live.path, live

    def _forget(self, path: Path | None = None) -> None:
        self._path, model = path, self._model
        model.live, model.view, model.voids, model.indicators = None, None, Voids(), Indicators()
        model.unreadable = ""

    def absorb(self, *, reopens: bool) -> Iterator[Event]:
        """Take over the daemon's present state, and yield events for its changes.

        Parameters
        ----------
        reopens
            Whether a closed session will be opened again from here, once this client has control.
        """
        client, stage = self._model.client, self._model.flow.stage
        state = self._model.state = client.state
        self._look_at_gates(state)
        if not client.up:
            code = "lost_before_release" if stage in BEFORE_RELEASE else "lost_in_fall"
            yield campaign.Lost(rig_error(code).two_lines)
            return
        yield from _back(client, state)
        yield from _broken(stage, state)
        if state.section("session"):
            self._look_at_session(state)
            yield campaign.SessionOpen()
        elif not (reopens and client.driving):
            self._forget()
            yield campaign.SessionClose()
        if not client.driving and stage not in {Stage.LIVE, Stage.JUDGING}:
            yield campaign.Lost(rig_error("control_taken").two_lines)
        missed = job_to_judge(state.runs)
        if missed and client.driving:
            yield campaign.Found(missed)

    def _look_at_gates(self, state: DaemonState) -> None:
        model, now = self._model, monotonic()
        if model.view and not model.indicators.gates:
            model.indicators, self._counted = Indicators.of(model.view.channels), (None, 0)
        drop = state.section("drop")
        job = Job(drop["run"], drop["attempt"]) if drop else None
        last, counted = self._counted
        fresh = state.edges[counted if job == last else 0 :]
        if fresh and drop.get("state") == "fired":
            channels = tuple(int(edge[1]) for edge in fresh)
            model.indicators = model.indicators.count_edges(channels, now)
        else:
            model.indicators = model.indicators.seen(state.blocked_mask, now)
        self._counted = job, len(state.edges)

    def _look_at_session(self, state: DaemonState) -> None:
        session = state.section("session")
        path = Path(str(session["path"]))
        if self._path != path:
            self._forget(path)
        self._wanted = (path, state.runs, session.get("blind"), int(monotonic() / _CLOCK_S))
        if self._wanted != self._read and not self._reading:
            self._reading = True
            self._begin(self._read_quietly())

    # ------------------------------------------------------------------ the file

    async def read(self) -> SessionView:
        """Read the session file as it is now.

        Raises
        ------
        RigError
            It cannot be read.
        """
        path, request, model = self._path, self._wanted, self._model
        if path is None:
            raise RigError("no session is open")
        self._reading = True
        try:
            if model.live is None:
                model.live = await asyncio.to_thread(open_live, path)
            live = model.live
            view = await asyncio.to_thread(live.read)
        finally:
            self._reading, self._read = False, request
        if path == self._path:
            model.view, model.unreadable, model.voids = view, "", voids_of(view.states)
            model.client.changed = True
        if view.lagging and not self._fitting:
            self._fitting = True
            self._begin(self._fit_jointly(live, view))
        return view

    async def _read_quietly(self) -> None:
        try:
            await self.read()
        except RigError as error:
            self._model.unreadable = error.two_lines

    async def _fit_jointly(self, live: LiveAnalysis, view: SessionView) -> None:
        try:
            await asyncio.to_thread(live.fit_jointly, view)
        finally:
            self._fitting = False
        if live is self._model.live:
            await self._read_quietly()


def open_live(path: Path) -> LiveAnalysis:
    """Open a session file to be analysed while it grows."""
    from rig.results.live import LiveAnalysis  # noqa: PLC0415 - the analysis is not needed to paint

    return LiveAnalysis(path)


def _back(client: ReconnectingClient, state: DaemonState) -> Iterator[Event]:
    """Yield the event for a port that is back, as its loss may have been too short to be seen."""
    # With an error it is back, but still being checked.
    if client.lost and state.link == "up" and not state.section("error"):
        lost, client.lost = client.lost, {}
        yield campaign.Notice(f"the port was lost and is back: {lost['message']}\n{lost['hint']}")


def _broken(stage: Stage, state: DaemonState) -> Iterator[Event]:
    """Yield the event that an armed or arming drop has failed, as no answer will follow."""
    if stage in BEFORE_RELEASE and state.link == "down":
        yield campaign.Lost(rig_error("unplugged_before_release").two_lines)
    drop = state.section("drop")
    if stage is Stage.COUNTDOWN and drop.get("state") == "interrupted":
        line = state.line(drop["run"])
        why = line.reasons[0] if line and line.reasons else "stopped"
        yield campaign.Lost(f"{why}: nothing fell\narm again when this is mended")
