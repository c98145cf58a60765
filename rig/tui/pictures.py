"""The main screens as SVG, drawn from a recorded session: the same file gives the same pictures."""

from __future__ import annotations

import asyncio
import re
from dataclasses import replace
from time import monotonic
from typing import TYPE_CHECKING, Any, NamedTuple

from rig.campaign.events import Stage
from rig.campaign.machine import Flow
from rig.files import make_folder
from rig.results.live import LiveAnalysis
from rig.tui.app import RigApp
from rig.tui.client import ReconnectingClient
from rig.tui.context import Options
from rig.tui.replay import Player, end_of
from rig.tui.state import DaemonState, state_of
from rig.tui.widgets.figure import PAUSE_S

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from textual.pilot import Pilot

    from rig.records import Job
    from rig.results.live import SessionView

SIZE = (120, 36)
_LIVE_SHARE = 0.9
_FONT = '"DejaVu Sans Mono", "Liberation Mono", Menlo, Consolas, monospace'


GATES = {"blocked": 0, "age_s": 0.1}
QUIET: Mapping[str, Any] = {
    "daemon": {"version": "", "pid": 0, "api": 1},
    "port": {"url": "sim://", "simulated": True},
    "link": {"state": "up", "error": None, "retry_s": None},
    "device": {"board": "virtual", "firmware": "sim", "unique_id": "3be41d96e0299308",
               "tick_hz": 16_000_000},
    "statistics": {"rx_frames": 1204, "rx_bad": 0, "rx_unreadable": 0, "repeats": 0,
                   "round_trip_s": 0.0011},
    "gates": GATES,
    "phase": "idle",
    "drop": None,
    "session": None,
    "control": None,
    "clients": 1,
    "error": None,
}  # fmt: skip
"""Sections of a rig at rest, without a session."""


class FakeClient(ReconnectingClient):
    """Shows one state and carries nothing out.

    Parameters
    ----------
    state
        What the daemon would say.
    """

    def __init__(self, state: DaemonState) -> None:
        super().__init__(str(state.section("port").get("url", "")), None, self._nothing)
        self._state = state

    @property
    def up(self) -> bool:
        """Always."""
        return True

    @property
    def driving(self) -> bool:
        """Always."""
        return True

    @property
    def state(self) -> DaemonState:
        """The one it was given."""
        return self._state

    async def call(self, method: str, **params: Any) -> Any:
        """Never answer."""
        del method, params
        await asyncio.Event().wait()

    async def keep(self) -> None:
        """Wait to be cancelled."""
        await asyncio.Event().wait()

    async def _nothing(self) -> None:
        return


class Screenshot(NamedTuple):
    """One picture: its name, and the moment it shows."""

    name: str
    flow: Flow
    state: DaemonState


def draw(session: Path, folder: Path, keys: Mapping[str, str]) -> list[Path]:
    """Draw every main screen.

    Parameters
    ----------
    session
        With one drop at least.
    folder
        Made if it is not there.
    keys
        Of every action, by name.

    Returns
    -------
    list of Path
        The files.
    """
    view = LiveAnalysis(session).read()
    make_folder(folder)
    written = []
    for shot in screenshots(view):
        path = folder / f"{shot.name}.svg"
        path.write_text(asyncio.run(_picture(shot, session, keys)), "utf-8")
        written.append(path)
    return written


def screenshots(view: SessionView) -> list[Screenshot]:
    """Choose the moments."""
    job = view.jobs[-1]
    whole = state_of(view)
    session = whole.sections["session"]
    state = replace(whole, sections={**QUIET, "session": session})
    before = replace(
        state,
        runs=tuple(
            line._replace(state="planned", attempt=0) if line.run == job.run else line
            for line in whole.runs
        ),
    )
    said = view.results[job]
    result = Flow(Stage.RESULT, job, verdict=said.verdict, reasons=said.reasons)
    return [
        Screenshot("device", Flow(Stage.DEVICE), before),
        Screenshot("run", Flow(Stage.PREPARE, job), before),
        Screenshot("live", Flow(Stage.LIVE, job), _falling(before, view, job)),
        Screenshot("result", result, state),
        Screenshot("session", Flow(Stage.DONE), state),
        Screenshot("history", Flow(Stage.DONE), state),
    ]


def _falling(state: DaemonState, view: SessionView, job: Job) -> DaemonState:
    """Stop the clock in the middle of a drop."""
    drop = view.drops[job]
    until = _LIVE_SHARE * drop.edges[-1].tick
    section = {"run": job.run, "attempt": job.attempt, "state": "fired", "tick_hz": drop.tick_hz}
    edges = tuple([*edge] for edge in drop.edges if edge.tick <= until)
    return DaemonState(
        0, {**state.sections, "drop": section, "phase": "recording"}, state.runs, edges
    )


async def _picture(shot: Screenshot, session: Path, keys: Mapping[str, str]) -> str:
    client = FakeClient(shot.state)
    app = RigApp(Options(session=session), keys, client)
    app.driver.flow = shot.flow
    async with app.run_test(size=SIZE) as pilot:
        while app.view is None or app.view.lagging or not app.indicators.known:
            client.changed = True
            await pilot.pause()
        if shot.name == "history":
            first = app.view.jobs[0]
            end = end_of(app.view.drops[first], app.view.scales[first].hz)
            app.history.player = Player(0, 0.8 * end)
            app.turn("history")
            while app.page != "history":
                await pilot.pause()
        # All edges came at once, which looks like flicker for a while.
        while len(shot.state.edges) > sum(gate.edges for gate in app.indicators.gates) or any(
            gate.flickers(now := monotonic()) or not gate.steady(now)
            for gate in app.indicators.gates
        ):
            await pilot.pause(PAUSE_S)
        return portable(await at_rest(app, pilot, lambda: app.export_screenshot(title="chainrig")))


async def at_rest(app: RigApp, pilot: Pilot[None], look: Callable[[], str]) -> str:
    """Look at a screen once it stays as it is.

    Parameters
    ----------
    look
        What to look at, such as the whole screen.

    Returns
    -------
    str
        What was seen last.
    """
    before, now = "", look()
    while now != before:
        # Figures are drawn again when their place is known, and only so often. Drawn here, for on
        # a busy machine the app's own next drawing may be later.
        await pilot.pause(1.2 * PAUSE_S)
        app.draw()
        await pilot.pause()
        before, now = now, look()
    return now


def portable(svg: str) -> str:
    """Take fonts from the reader's machine instead of from a server."""
    svg = re.sub(r"@font-face\s*\{[^}]*\}", "", svg)
    svg = re.sub(r"font-family:\s*(Fira Code|arial)[^;]*;", f"font-family: {_FONT};", svg)
    svg = svg.replace("<svg ", '<svg xml:space="preserve" ', 1)  # or leading blanks are lost
    # Names in it depend on what else this program drew before.
    return re.sub(r"terminal-\d+-", "rig-", svg)
