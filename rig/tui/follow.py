"""Follower of the daemon and the session file, which turns changes into state and events."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig.campaign import machine as campaign
from rig.campaign.machine import BEFORE_RELEASE, Event, Stage
from rig.campaign.plan import job_to_judge
from rig.campaign.voids import Voids, voids_of
from rig.errors import RigError
from rig.records import Job
from rig.tui.client import ReconnectingClient
from rig.tui.indicators import Indicators
from rig.tui.state import DaemonState, state_of

if TYPE_CHECKING:
    from rig.results.live import LiveAnalysis, SessionView

_UNHEARD = (
    "the daemon was lost before the release: nothing fell\n"
    "the board switches itself off; arm again when the daemon is back"
)
_UNSEEN = (
    "the daemon was lost during the fall\n"
    "daemon or board keeps the drop; it is analysed when the daemon is back"
)
_UNPLUGGED = "the port was lost before the release: nothing fell\narm again when it is back"
_TAKEN = "another client took control of the rig\npress c to take it when it is free"
_CLOCK_S = 3.0
"""Time between readings of the file, as clock samples also arrive between drops, s."""


class Follower:
    """Holds the latest state of rig and session.

    Parameters
    ----------
    client
        Client of the daemon; `None` to show only a file.
    begin
        Runs a coroutine in the background.

    Attributes
    ----------
    state
        Latest state of the daemon.
    indicators
        State of the gates.
    view
        Latest view of the session file.
    voids
        Void drops by the session's log.
    judged
        Drops with a verdict from this screen.
    unreadable
        Why the session file cannot be read; empty if it can.
    """

    def __init__(
        self, client: ReconnectingClient, begin: Callable[[Coroutine[Any, Any, None]], object]
    ) -> None:
        self.state = DaemonState()
        self.indicators = Indicators()
        self.view: SessionView | None = None
        self.voids = Voids()
        self.judged: set[Job] = set()
        self.unreadable = ""
        self._client = client
        self._begin = begin
        self._path: Path | None = None
        self._live: LiveAnalysis | None = None
        self._reading = self._fitting = False
        self._wanted: object = None
        self._read: object = None
        self._counted: tuple[Job | None, int] = (None, 0)

    @property
    def done(self) -> int:
        """Number of drops of the file analysed so far."""
        return self._live.done if self._live else 0

    async def show_file(self, path: Path) -> None:
        """Show a file that has no writer."""
        self._forget(path)
        await self._read_quietly()
        if self.view is not None:
            self.state, self.indicators = state_of(self.view), Indicators.of(self.view.channels)

    def look_with(self, live: LiveAnalysis) -> None:
        """Show a file with an existing live analysis."""
        self._path, self._live = live.path, live

    def _forget(self, path: Path | None = None) -> None:
        self._path, self._live, self.view = path, None, None
        self.voids, self.indicators = Voids(), Indicators()

    def absorb(self, stage: Stage, now: float, *, reopens: bool) -> list[Event]:
        """Take over the daemon's present state, and return events for its changes.

        Parameters
        ----------
        stage
            Present stage of the campaign.
        now
            Monotonic time, s.
        reopens
            Whether a closed session will be opened again from here.
        """
        client, before = self._client, self.state
        state = self.state = client.state
        self._look_at_gates(state, now)
        if not client.up:
            return [campaign.Lost(_UNHEARD if stage in BEFORE_RELEASE else _UNSEEN)]
        events: list[Event] = [*_back(client, state), *_broken(stage, state)]
        session = state.section("session")
        if session:
            self._look_at_session(session, state, now)
            events.append(campaign.SessionOpen())
        elif before.section("session") and not reopens:
            self._forget()
            events.append(campaign.SessionClose())
        if not client.driving and stage not in {Stage.LIVE, Stage.JUDGING}:
            events.append(campaign.Lost(_TAKEN))
        missed = job_to_judge(state.runs)
        if missed and missed not in self.judged and client.driving:
            events.append(campaign.Found(missed))
        return events

    def _look_at_gates(self, state: DaemonState, now: float) -> None:
        if self.view and not self.indicators.gates:
            self.indicators, self._counted = Indicators.of(self.view.channels), (None, 0)
        drop = state.section("drop")
        job = Job(drop["run"], drop["attempt"]) if drop else None
        last, counted = self._counted
        fresh = state.edges[counted if job == last else 0 :]
        if fresh and drop.get("state") == "fired":
            channels = tuple(int(edge[1]) for edge in fresh)
            self.indicators = self.indicators.count_edges(channels, now)
        else:
            self.indicators = self.indicators.seen(state.blocked_mask, now)
        self._counted = job, len(state.edges)

    def _look_at_session(
        self, session: Mapping[str, object], state: DaemonState, now: float
    ) -> None:
        path = Path(str(session["path"]))
        if self._path != path:
            self._forget(path)
        self._wanted = (path, state.runs, session.get("blind"), int(now / _CLOCK_S))
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
        path, request = self._path, self._wanted
        if path is None:
            raise RigError("no session is open")
        self._reading = True
        try:
            if self._live is None:
                self._live = await asyncio.to_thread(open_live, path)
            live = self._live
            view = await asyncio.to_thread(live.read)
        finally:
            self._reading, self._read = False, request
        if path == self._path:
            self.view, self.unreadable, self.voids = view, "", voids_of(view.states)
            self._client.changed = True
        if view.lagging and not self._fitting:
            self._fitting = True
            self._begin(self._fit_jointly(live, view))
        return view

    async def _read_quietly(self) -> None:
        try:
            await self.read()
        except RigError as error:
            self.unreadable = f"{error.message}\n{error.hint}"

    async def _fit_jointly(self, live: LiveAnalysis, view: SessionView) -> None:
        try:
            await asyncio.to_thread(live.fit_jointly, view)
        finally:
            self._fitting = False
        if live is self._live:
            await self._read_quietly()


def open_live(path: Path) -> LiveAnalysis:
    """Open a session file to be analysed while it grows."""
    from rig.results.live import LiveAnalysis  # noqa: PLC0415 - the analysis is not needed to paint

    return LiveAnalysis(path)


def _back(client: ReconnectingClient, state: DaemonState) -> Iterator[Event]:
    """Yield the event for a port that is back, as its loss may have been too short to be seen."""
    if state.link != "up" or state.section("error"):  # back, but still being checked
        return
    lost, client.lost = client.lost, {}
    if lost:
        yield campaign.Notice(f"the port was lost and is back: {lost['message']}\n{lost['hint']}")


def _broken(stage: Stage, state: DaemonState) -> Iterator[Event]:
    """Yield the event that an armed or arming drop has failed, as no answer will follow."""
    if stage not in BEFORE_RELEASE:
        return
    if state.link == "down":
        yield campaign.Lost(_UNPLUGGED)
    drop = state.section("drop")
    if stage is Stage.COUNTDOWN and drop.get("state") == "interrupted":
        line = state.line(drop["run"])
        why = line.reasons[0] if line and line.reasons else "stopped"
        yield campaign.Lost(f"{why}: nothing fell\narm again when this is mended")
