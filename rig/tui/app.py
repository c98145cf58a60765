"""The app: one clock, one flow, pages that draw what they are shown."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, replace
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING

from textual import events
from textual.app import App, ComposeResult, SystemCommand
from textual.widgets import ContentSwitcher, Input

from rig.errors import RigError
from rig.tui import effects, themes
from rig.tui.actions import ACTIONS, BY_NAME, OFFLINE, possible, shown_key
from rig.tui.findings import Book
from rig.tui.flow import (
    BEFORE_RELEASE,
    COUNTDOWN_S,
    Again,
    Closed,
    Flow,
    Found,
    GoOn,
    Lost,
    Note,
    Opened,
    Refused,
    Reject,
    Stage,
    Stopped,
    Tick,
    step,
)
from rig.tui.gates import Lamps
from rig.tui.model import Model
from rig.tui.plan import Job, again, next_job, unjudged, void_counts
from rig.tui.screens.ask import Ask
from rig.tui.screens.device import DevicePage
from rig.tui.screens.help import Help
from rig.tui.screens.history import HistoryPage
from rig.tui.screens.protocol import ProtocolPage
from rig.tui.screens.result import ResultPage
from rig.tui.screens.run import RunPage
from rig.tui.screens.session import SessionPage
from rig.tui.state import State
from rig.tui.widgets.status import Status
from rig.tui.widgets.stopbar import StopBar
from rig.tui.wire import Wire

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from textual.screen import Screen

    from rig.tui.findings import Findings
    from rig.tui.flow import Event
    from rig.tui.screens.page import Page
    from rig.tui.state import RunLine

TICK_S = 0.1
_REPEAT_S = 0.7  # a key that is held down repeats itself: that is no wish to stop
_CLOCK_S = 2.0  # of clock samples before the first drop, as the runner takes them
_CLOCK_U = 1e-4
_PAGE_OF = {
    Stage.PROTOCOL: "protocol",
    Stage.DEVICE: "device",
    Stage.RESULT: "result",
    Stage.DONE: "session",
}


@dataclass(frozen=True, slots=True)
class Options:
    """What the command line says.

    Attributes
    ----------
    files
        Protocols to choose from.
    port
        Empty to watch a daemon that runs already.
    session
        The file to be made or continued.
    offline
        Only look at `session`: no daemon is asked for.
    """

    files: tuple[Path, ...] = ()
    port: str = ""
    session: Path | None = None
    seed: int | None = None
    socket: Path | None = None
    offline: bool = False
    countdown_s: float = COUNTDOWN_S


class RigApp(App[None]):
    """The lab session.

    Parameters
    ----------
    options
        What the command line says.
    keys
        Of every action, by name.
    wire
        Another line to the rig than the options ask for.
    """

    TITLE = "chainrig"
    CSS = """
    Screen { background: $background; color: $foreground; }
    #pages { height: 1fr; }
    .-high #pages { padding: 1 1 0 1; }
    """
    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (100, "-normal"), (160, "-wide")]  # noqa: RUF012
    VERTICAL_BREAKPOINTS = [(0, "-low"), (30, "-high")]  # noqa: RUF012

    def __init__(self, options: Options, keys: Mapping[str, str], wire: Wire | None = None) -> None:
        super().__init__()
        self.options = options
        self.keys = keys
        start = Stage.DONE if options.offline else Stage.PROTOCOL
        self.flow = Flow(stage=start, countdown_s=options.countdown_s)
        self.state = State()
        self.lamps = Lamps()
        self.findings: Findings | None = None
        self.page = ""
        self.wire = wire
        if wire is None and not options.offline:
            self.wire = Wire(options.port, options.socket, self._reached)
        self._by_key = {key: name for name, given in keys.items() for key in given.split(",")}
        self._pages: dict[str, Page] = {
            page.NAME: page
            for page in (
                ProtocolPage(options.files, options.session),
                DevicePage(), RunPage(), ResultPage(), SessionPage(), HistoryPage(),
            )
        }  # fmt: skip
        self._book: Book | None = None
        self._reading = False
        self._wanted: object = None
        self._read: object = None
        self._asked: tuple[str, str] | None = None  # protocol and session this client opened
        self._judged: set[Job] = set()
        self._counted: tuple[Job | None, int] = (None, 0)
        self._last = monotonic()
        self._since = 0.0
        self._followed = ""
        for theme in themes.THEMES:
            self.register_theme(theme)
        self.theme = themes.NAMES[0]

    # ------------------------------------------------------------------ life

    def compose(self) -> ComposeResult:
        yield Status()
        yield ContentSwitcher(id="pages")
        yield StopBar()

    async def on_mount(self) -> None:
        if self.wire is not None:
            self.run_worker(self.wire.keep(), group="wire")
        elif self.options.session is not None:
            self._book = Book(self.options.session)
            self.findings = await asyncio.to_thread(self._book.read)
            self.state = self.findings.state()
            self.lamps = Lamps.of(self.findings.channels)
        await self._follow()
        self.set_interval(TICK_S, self._tick)
        self._draw()

    async def _tick(self) -> None:
        if not self.screen_stack:
            return  # the app is on its way out
        now = monotonic()
        passed, self._last = now - self._last, now
        if self.flow.stage is Stage.COUNTDOWN:
            self.event(Tick(passed))
        history = self._pages["history"]
        assert isinstance(history, HistoryPage)
        history.tick(passed, self.findings)
        if self.wire is not None and self.wire.changed:
            self.wire.changed = False
            self._absorb(self.wire.state, now)
        await self._follow()
        self._draw()

    def _draw(self) -> None:
        model, width = self.model, self.size.width
        base = self.screen_stack[0]
        if not base.query("Status #alarm") or not base.query("StopBar #stop"):
            return  # on its way in, or out
        base.query_one(Status).show(model, self.page, width)
        base.query_one(StopBar).show(model, self.page, self.keys, width)
        page = self._pages.get(self.page)
        if page is not None and page.is_mounted:
            page.show(model)

    @property
    def model(self) -> Model:
        """What the pages are drawn from, now."""
        wire = self.wire
        return Model(
            state=self.state,
            flow=self.flow,
            lamps=self.lamps,
            protocol=self.findings.protocol if self.findings else None,
            findings=self.findings,
            connected=wire is None or wire.up,
            driving=wire is not None and wire.driving,
            job=self._job(),
            now_s=monotonic(),
            silence=wire.silence if wire else "",
            settle_s=self._settle_s(),
            port=wire.port if wire else "",
            offline=wire is None,
        )

    # ------------------------------------------------------------------ what the daemon says

    async def _reached(self) -> None:
        """Go on where the daemon, or a new one, is."""
        assert self.wire is not None
        if self._asked and self.wire.driving and not self.wire.state.section("session"):
            await self._open(*self._asked)

    def _absorb(self, state: State, now: float) -> None:
        assert self.wire is not None
        before, self.state = self.state, state
        self._look_at_gates(state, now)
        if not self.wire.up:
            self.event(Lost(f"the line to the daemon broke\n{self.wire.silence}"))
            return
        session = state.section("session")
        if session:
            self._look_at_session(session, state)
        elif before.section("session") and not self._asked:
            self.findings, self._book = None, None
            self.event(Closed())
        if not self.wire.driving and self.flow.stage not in {Stage.LIVE, Stage.JUDGING}:
            self.event(
                Lost("control of the rig went to another client\nc takes it when it is free")
            )
        missed = unjudged(state.runs)
        if missed and missed not in self._judged and self.wire.driving:
            self.event(Found(missed))

    def _look_at_gates(self, state: State, now: float) -> None:
        if self.findings and not self.lamps.lamps:
            self.lamps, self._counted = Lamps.of(self.findings.channels), (None, 0)
        drop = state.section("drop")
        job = Job(drop["run"], drop["attempt"]) if drop else None
        known, counted = self._counted
        if job != known:
            counted = 0
        if len(state.edges) > counted and drop.get("state") == "fired":
            fresh = tuple(int(edge[1]) for edge in state.edges[counted:])
            self.lamps = self.lamps.counted(fresh, now)
        else:
            self.lamps = self.lamps.seen(state.blocked, now)
        self._counted = job, len(state.edges)

    def _look_at_session(self, session: Mapping[str, object], state: State) -> None:
        path = Path(str(session["path"]))
        if self._book is None or self._book.path != path:
            self._book = Book(path)
            self.lamps = Lamps()
        self.event(Opened())
        # Clock samples come between drops too, so it is read again now and then.
        self._wanted = (path, state.runs, int(monotonic() // 3))
        if self._wanted != self._read and not self._reading:
            self.run_worker(self.read(), group="read")

    async def read(self) -> Findings:
        """Read the session file as it is now.

        Raises
        ------
        RigError
            It cannot be read.
        """
        book, wanted = self._book, self._wanted
        if book is None:
            raise RigError("no session is open")
        self._reading = True
        try:
            found = await asyncio.to_thread(book.read)
        finally:
            self._reading = False
        self._read, self.findings = wanted, found
        if self.wire is not None:
            self.wire.changed = True
        return found

    # ------------------------------------------------------------------ the flow

    def event(self, event: Event) -> None:
        """Let the flow take an event, and have its effects carried out."""
        before = self.flow.stage
        self.flow, wanted = step(self.flow, event)
        if self.flow.stage is not before:
            self._since = monotonic()
        if self.flow.stage is Stage.RESULT and self.flow.job is not None:
            self._judged.add(self.flow.job)
        for effect in wanted:
            self.run_worker(effects.carry_out(self, effect, self.flow.ticket), group="effects")

    def _runs(self) -> tuple[RunLine, ...]:
        """Return the plan as it stands, our own latest verdict in it."""
        flow = self.flow
        if flow.stage is not Stage.RESULT or flow.job is None:
            return self.state.runs
        job = flow.job
        return tuple(
            line._replace(state=flow.verdict, attempt=job.attempt) if line.run == job.run else line
            for line in self.state.runs
        )

    def _next(self) -> Job | None:
        runs = self._runs()
        if self.flow.stage is Stage.PREPARE and self.flow.job is not None:
            return again(runs, self.flow.job.run)
        known = self.findings.voids if self.findings else frozenset()
        return next_job(runs, void_counts(known, runs))

    def _job(self) -> Job | None:
        """The attempt that the screens are about."""
        if self.wire is None:
            return self.findings.jobs[-1] if self.findings and self.findings.jobs else None
        if not self.wire.driving:
            drop = self.state.section("drop")
            if drop:
                return Job(drop["run"], drop["attempt"])
        if self.flow.stage in {Stage.PREPARE, Stage.DEVICE, Stage.DONE}:
            if self.page == "result" and self.findings and self.findings.jobs:
                return self.findings.jobs[-1]
            return self._next()
        return self.flow.job

    def _settle_s(self) -> float:
        if self.findings is None:
            return 0.0
        clock = self.findings.clock.device
        settle = self.findings.protocol.plan.settle
        return settle if clock is not None and clock.u <= _CLOCK_U else max(settle, _CLOCK_S)

    async def _follow(self) -> None:
        """Show the page of the stage when the stage has changed."""
        wanted = _PAGE_OF.get(self.model.stage, "run")
        if self.options.offline:
            wanted = "history"
        if wanted != self._followed:
            self._followed = wanted
            await self.go(wanted)

    async def go(self, page: str) -> None:
        """Show a page."""
        switcher = self.screen_stack[0].query_one("#pages", ContentSwitcher)
        if not self._pages[page].is_mounted:
            await switcher.add_content(self._pages[page], id=page)
        switcher.current = page
        self.page = page
        self._draw()

    # ------------------------------------------------------------------ keys

    async def on_event(self, event: events.Event) -> None:
        """Take keys before anybody else: STOP must work with focus anywhere."""
        if isinstance(event, events.Key) and not event.is_forwarded and self._takes(event.key):
            event.stop()
            return
        await super().on_event(event)

    def _takes(self, key: str) -> bool:
        name = self._by_key.get(key)
        stage = self.flow.stage
        typing = isinstance(self.focused, Input)
        if name == "stop" or (key == "escape" and not typing):
            self.action_do("stop")
            if isinstance(self.screen, Help):
                self.screen.dismiss(None)
            return True
        if stage in BEFORE_RELEASE:
            held = name == "go_on" and monotonic() - self._since < _REPEAT_S
            if not held:
                self.event(Stopped())
            return True
        if key == "escape" and isinstance(self.screen, Ask):
            self.screen.dismiss(None)
            return True
        if isinstance(self.screen, Help):
            if name in {"previous", "next"}:
                self.screen.move(1 if name == "next" else -1)
            else:
                self.screen.dismiss(None)
            return True
        if len(self.screen_stack) > 1 or name is None:
            return False
        self.action_do(name)
        return True

    def action_do(self, name: str) -> None:
        """Do one action of the table, if it makes sense now."""
        action = BY_NAME[name]
        driving = self.wire is not None and self.wire.driving
        if self.wire is None and name not in OFFLINE:
            return
        if not possible(action, self.flow.stage, driving=driving):
            if action.driving and not driving:
                self.event(Refused(self.flow.ticket, "this screen only watches\n"
                                   "c takes control when it is free"))  # fmt: skip
            return
        self.run_worker(effects.do(self, name), group="actions")

    def action_choose(self, at: int) -> None:
        """Choose a protocol by mouse."""
        page = self._pages["protocol"]
        assert isinstance(page, ProtocolPage)
        page.move(at - page.chosen)
        self._draw()

    def get_system_commands(self, screen: Screen[object]) -> Iterable[SystemCommand]:
        """Name every action that makes sense now."""
        del screen
        driving = self.wire is not None and self.wire.driving
        for action in ACTIONS:
            if self.wire is None and action.name not in OFFLINE:
                continue
            if action.name != "palette" and possible(action, self.flow.stage, driving=driving):
                told = f"{shown_key(self.keys[action.name])}  {action.command}".rstrip()
                yield SystemCommand(
                    action.text, told, lambda name=action.name: self.action_do(name)
                )

    # ------------------------------------------------------------------ what actions need

    async def go_on(self) -> None:
        """Take the next step of the flow."""
        if self.flow.stage is not Stage.PROTOCOL:
            self.event(GoOn(self._next(), self._settle_s()))
            return
        page = self._pages["protocol"]
        assert isinstance(page, ProtocolPage)
        if page.file is not None and page.usable and page.session is not None:
            await self._open(str(page.file.resolve()), str(page.session.resolve()))

    async def _open(self, protocol: str, session: str) -> None:
        assert self.wire is not None
        try:
            await self.wire.call(
                "open_session", protocol=protocol, session=session, seed=self.options.seed
            )
        except RigError as error:
            self.event(Refused(self.flow.ticket, f"{error.message}\n{error.hint}"))
        else:
            self._asked = protocol, session

    async def close(self) -> None:
        """Close the session, so that another can be chosen."""
        assert self.wire is not None
        self._asked = None
        await self.wire.call("close_session")

    def ask_reject(self) -> None:
        """Ask why, then reject."""
        self._ask("Why is this drop rejected?", Reject)

    def ask_note(self) -> None:
        """Ask for a note, then add it."""
        self._ask("Note on this drop:", Note)

    def _ask(self, question: str, answer: type) -> None:
        def given(text: str | None) -> None:
            if text:
                self.event(answer(text))

        self.push_screen(Ask(question, shown_key(self.keys["stop"])), given)

    def repeat(self) -> None:
        """Go back to a run for another attempt."""
        job = self.flow.job or self._job()
        wanted = again(self._runs(), job.run) if job else None
        if wanted is not None:
            self.event(Again(wanted))

    def toggle_blind(self) -> None:
        """Change whether drops are judged before their numbers are shown."""
        self.flow = replace(self.flow, blind=not self.flow.blind)

    def begin_lamps(self) -> None:
        """Count from zero."""
        self.lamps = self.lamps.reset()

    def move(self, by: int) -> None:
        """Go to the previous or next of whatever this page lists."""
        page = self._pages[self.page]
        if isinstance(page, (ProtocolPage, SessionPage)):
            page.move(by)
        elif isinstance(page, HistoryPage) and self.findings:
            page.player = page.player.other(by, len(self.findings.jobs))

    @property
    def history(self) -> HistoryPage:
        """The page with the tape."""
        page = self._pages["history"]
        assert isinstance(page, HistoryPage)
        return page

    def next_theme(self) -> None:
        """Change colours."""
        self.theme = themes.after(self.theme)

    def show_help(self) -> None:
        """Show the table of actions."""
        self.push_screen(Help(self.page, self.keys))
