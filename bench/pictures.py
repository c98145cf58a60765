"""All pages as SVG, drawn from a recorded session: the same file gives the same pictures."""

from __future__ import annotations

import asyncio
import re
from dataclasses import replace
from html import unescape
from pathlib import Path
from time import monotonic
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, NamedTuple

from rig.bench.findings import Findings
from rig.campaign.machine import Flow, Stage
from rig.files import make_folder, require_file
from rig.results.live import LiveAnalysis
from rig.tui.app import RigApp
from rig.tui.braille import COLUMNS, ROWS, dots_of
from rig.tui.client import ReconnectingClient
from rig.tui.context import Options
from rig.tui.keys import read_keys
from rig.tui.replay import Player
from rig.tui.state import DaemonState, state_of
from rig.tui.widgets.spans import PAUSE_S

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from textual.pilot import Pilot

    from rig.records import Job
    from rig.results.live import SessionView

SIZES = ((80, 24), (120, 36), (200, 60))
"""Columns and lines of the terminals that are drawn."""
THEMES_DRAWN = ("dark", "light")
_LIVE_SHARE = 0.9
_REPLAYED_S = 0.4
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

    @property
    def connection(self) -> Any:
        """Never answer."""
        return SimpleNamespace(call=lambda *_, **__: self.keep())

    async def keep(self) -> None:
        """Wait to be cancelled."""
        await asyncio.Event().wait()

    async def _nothing(self) -> None:
        return


def run(arguments: Namespace) -> Iterator[Findings]:
    """Draw all pages of a session; name the files."""
    session = Path(arguments.session)
    require_file(session)
    protocols = tuple(sorted(Path("protocols").glob("*.yaml")))
    paths = draw(session, Path(arguments.output), read_keys(None), protocols)
    files = [*map(str, paths)]
    yield Findings({"files": files}, files)


class Screenshot(NamedTuple):
    """One picture: its name, the page, and the moment it shows."""

    name: str
    page: str
    flow: Flow
    state: DaemonState


def draw(
    session: Path,
    folder: Path,
    keys: Mapping[str, str],
    files: tuple[Path, ...] = (),
    sizes: Sequence[tuple[int, int]] = SIZES,
    themes: Sequence[str] = THEMES_DRAWN,
) -> list[Path]:
    """Draw every page.

    Parameters
    ----------
    session
        With one drop at least.
    folder
        Made if it is not there.
    keys
        Of every action, by name.
    files
        Protocols that the first page offers.
    sizes
        Columns and lines of each terminal.
    themes
        ``dark``, ``light`` or ``contrast``.

    Returns
    -------
    list of Path
        The files: page, size and theme of each in its name.
    """
    make_folder(folder)
    written = []
    for name, size, theme, svg in seen(session, keys, files, sizes, themes, _as_svg):
        path = folder / f"{name}-{size[0]}x{size[1]}-{theme}.svg"
        path.write_text(svg, "utf-8")
        written.append(path)
    return written


def seen(
    session: Path,
    keys: Mapping[str, str],
    files: tuple[Path, ...],
    sizes: Sequence[tuple[int, int]],
    themes: Sequence[str],
    look: Callable[[RigApp], str],
) -> Iterator[tuple[str, tuple[int, int], str, str]]:
    """Look at every page: its name, the size, the theme and what was seen; else as `draw`."""
    live = LiveAnalysis(session)
    view = live.read()
    if view.lagging:
        live.fit_jointly(view)
        view = live.read()
    for shot in screenshots(view):
        options = Options(files, session=session)
        for one in asyncio.run(_looks(shot, live, options, keys, sizes, themes, look)):
            yield shot.name, *one


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
    nothing = replace(state, sections={**QUIET}, runs=())
    return [
        Screenshot("protocol", "protocol", Flow(), nothing),
        Screenshot("device", "device", Flow(Stage.DEVICE), before),
        Screenshot("run", "run", Flow(Stage.PREPARE, job), before),
        Screenshot("live", "run", Flow(Stage.LIVE, job), _falling(before, view, job)),
        Screenshot("result", "result", result, state),
        Screenshot("session", "session", Flow(Stage.DONE), state),
        Screenshot("history", "history", Flow(Stage.DONE), state),
    ]


def _falling(state: DaemonState, view: SessionView, job: Job) -> DaemonState:
    """Stop the clock in the middle of a drop."""
    drop = view.drops[job]
    until = _LIVE_SHARE * drop.edges[-1].tick
    section = {"run": job.run, "attempt": job.attempt, "state": "fired", "tick_hz": drop.tick_hz}
    edges = tuple([*edge] for edge in drop.edges if edge.tick <= until)
    sections = {**state.sections, "drop": section, "phase": "recording"}
    return replace(state, sections=sections, edges=edges)


async def _looks(
    shot: Screenshot,
    live: LiveAnalysis,
    options: Options,
    keys: Mapping[str, str],
    sizes: Sequence[tuple[int, int]],
    themes: Sequence[str],
    look: Callable[[RigApp], str],
) -> list[tuple[tuple[int, int], str, str]]:
    """Look at one moment in every size and theme."""
    client = FakeClient(shot.state)
    app = RigApp(options, keys, client)
    app.model.flow = shot.flow
    app.desk.replayed = shot.flow.job  # its slow motion is over
    if shot.state.section("session"):
        app.follower.look_with(live)
    found = []
    async with app.run_test(size=sizes[0]) as pilot:

        async def until(true: Callable[[], object]) -> None:
            while not true() and not app.return_code:  # or it has failed, which is raised then
                client.changed = True
                await pilot.pause(0.02)

        if shot.state.section("session"):
            await until(lambda: app.model.view is not None and app.model.indicators.known)
        if shot.page == "history":
            app.desk.players["history"] = Player(0, _REPLAYED_S)
            app.turn("history")
        await until(lambda: app.model.page == shot.page and (app.model.view or app.desk.rows))
        # All edges came at once, which looks like flicker for a while.
        await until(lambda: _all_counted(app, shot) and _quiet(app))
        for size in sizes:
            await pilot.resize_terminal(*size)
            for theme in themes:
                app.theme = f"rig-{theme}"
                found.append((size, theme, await at_rest(app, pilot, lambda: look(app))))
    return found


def _as_svg(app: RigApp) -> str:
    return portable(app.export_screenshot(title="chainrig"))


def _all_counted(app: RigApp, shot: Screenshot) -> bool:
    return len(shot.state.edges) <= sum(gate.edges for gate in app.model.indicators.gates)


def _quiet(app: RigApp) -> bool:
    now = monotonic()
    return all(gate.steady(now) and not gate.flickers(now) for gate in app.model.indicators.gates)


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
    """Take fonts from the reader's machine instead of from a server, and braille from none."""
    svg = re.sub(r"@font-face\s*\{[^}]*\}", "", svg)
    svg = re.sub(r"font-family:\s*(Fira Code|arial)[^;]*;", f"font-family: {_FONT};", svg)
    svg = svg.replace("<svg ", '<svg xml:space="preserve" ', 1)  # or leading blanks are lost
    svg = _DOTTED.sub(_dots, svg)
    # Names in it depend on what else this program drew before.
    return re.sub(r"terminal-\d+-", "rig-", svg)


_DOTTED = re.compile(
    r'<text class="(?P<look>[^"]*)" x="(?P<x>[^"]*)" y="(?P<y>[^"]*)" textLength="(?P<width>[^"]*)"'
    r"[^>]*>(?P<text>[^<]*[\u2801-\u28ff][^<]*)</text>"
)
_HEIGHT = 24.4  # of a line in the pictures, of which text stands on the lower end
_ABOVE = 18.0  # of the place of a text up to the top of its line
_DOT = 2.6


def _dots(found: re.Match[str]) -> str:
    """Draw the dots of braille: few fonts have them."""
    text = unescape(found["text"])
    x, y, wide = float(found["x"]), float(found["y"]), float(found["width"]) / len(text)
    parts = []
    for number, letter in enumerate(text):
        for across, down in dots_of(letter):
            left = x + (number + (across + 0.5) / COLUMNS) * wide - 0.5 * _DOT
            top = y - _ABOVE + (down + 0.5) / ROWS * _HEIGHT - 0.5 * _DOT
            parts.append(f"M{left:.1f} {top:.1f}h{_DOT}v{_DOT}h-{_DOT}z")
    return f'<path class="{found["look"]}" d="{"".join(parts)}"/>'
