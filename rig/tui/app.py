"""The app: one clock, one flow, pages that draw what they are shown."""

from __future__ import annotations

import asyncio
from time import monotonic, process_time
from typing import TYPE_CHECKING, Any, cast

from textual import events
from textual.app import App, ComposeResult, SystemCommand
from textual.css.query import NoMatches
from textual.widgets import ContentSwitcher

from rig.campaign.events import Refused, Stage, Tick
from rig.campaign.machine import Flow, step
from rig.tui import doing, effects, keyboard, pages, seen, themes
from rig.tui.actions import ACTIONS, BY_NAME, OFFLINE, possible, shown_key
from rig.tui.client import ReconnectingClient
from rig.tui.follow import Follower
from rig.tui.screens.protocol import ProtocolPage
from rig.tui.widgets.status import Status
from rig.tui.widgets.stopbar import StopBar

if TYPE_CHECKING:
    from collections.abc import Coroutine, Iterable, Mapping

    from textual.screen import Screen

    from rig.campaign.events import Event
    from rig.results.live import SessionView
    from rig.tui.indicators import Indicators
    from rig.tui.model import Model
    from rig.tui.options import Options
    from rig.tui.screens.history import HistoryPage
    from rig.tui.screens.page import Page
    from rig.tui.state import State

TICK_S = 0.1
_SHARE = 0.17  # of a core, that this may take on a slow machine
_PAGE_OF = {
    Stage.PROTOCOL: "protocol",
    Stage.DEVICE: "device",
    Stage.RESULT: "result",
    Stage.HALTED: "result",
    Stage.DONE: "session",
}


class RigApp(App[None]):
    """The lab session.

    Parameters
    ----------
    options
        What the command line says.
    keys
        Of every action, by name.
    client
        Another line to the rig than the options ask for.
    """

    TITLE = "chainrig"
    CSS = """
    #pages { height: 1fr; }
    .-high #pages { padding: 1 1 0 1; }
    """
    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (100, "-normal"), (160, "-wide")]  # noqa: RUF012
    VERTICAL_BREAKPOINTS = [(0, "-low"), (30, "-high")]  # noqa: RUF012

    def __init__(
        self, options: Options, keys: Mapping[str, str], client: ReconnectingClient | None = None
    ) -> None:
        super().__init__()
        self.options = options
        self.keys: Mapping[str, str] = keys
        self.action_of = {key: name for name, given in keys.items() for key in given.split(",")}
        start = Stage.DONE if options.offline else Stage.PROTOCOL
        self.flow = Flow(stage=start, countdown_s=options.countdown_s)
        self.since = 0.0
        """When the flow came to its stage."""
        self.page: str = ""
        self.asked: tuple[str, str] | None = None
        """Protocol and session that were opened from here."""
        self.client = client
        if client is None and not options.offline:
            self.client = ReconnectingClient(options.port, options.socket, self._reached)
        self.follower = Follower(self.client, self._begin)
        self.protocols = ProtocolPage(options.files, options.session)
        self.pages: dict[str, Page] = {ProtocolPage.NAME: self.protocols}
        self._turning = asyncio.Lock()
        self._last = monotonic()
        self._spent = process_time()
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
        if self.client is not None:
            self.run_worker(self.client.keep(), group="client")
        elif self.options.session is not None:
            self.follower.look_at(self.options.session)
        await self._follow()
        self.set_timer(TICK_S, self._tick)
        self.draw()
        self.call_after_refresh(lambda: self._begin(self._load_pages()))

    def _begin(self, work: Coroutine[Any, Any, None]) -> None:
        self.run_worker(work, group="read")

    async def _tick(self) -> None:
        # Ten times a second, and down to five where that takes too much of the machine.
        before, self._spent = self._spent, process_time()
        pause = max(TICK_S, (self._spent - before) / _SHARE)
        self.set_timer(min(pause, 2 * TICK_S), self._tick)
        if not self._open():
            return
        now = monotonic()
        passed, self._last = now - self._last, now
        if self.flow.stage is Stage.COUNTDOWN:
            self.event(Tick(passed))
        if "history" in self.pages:
            self.history.tick(passed)
        if self.client is not None and self.client.changed:
            self.client.changed = False
            reopens = self.asked is not None
            for event in self.follower.absorb(self.flow.stage, now, reopens=reopens):
                self.event(event)
        await self._follow()
        self.draw()

    def _open(self) -> bool:
        """Whether there is a screen, and none that is being taken down."""
        return self.is_running and bool(self.screen_stack) and self.screen_stack[0].is_attached

    def draw(self) -> None:
        """Draw what changed since the last time."""
        if not self._open():
            return
        model, size, base = self.model, self.size, self.screen_stack[0]
        try:
            base.query_one("#alarm")
        except NoMatches:
            return  # on its way in, or out
        base.query_one(Status).show(model, self.page, self.keys, size)
        base.query_one(StopBar).show(model, self.page, self.keys, size.width)
        page = self.pages.get(self.page)
        if page is not None and page.is_mounted:
            page.show(model)

    # ------------------------------------------------------------------ what is known

    @property
    def state(self) -> State:
        """What the daemon said last."""
        return self.follower.state

    @property
    def indicators(self) -> Indicators:
        """The gates."""
        return self.follower.indicators

    @property
    def view(self) -> SessionView | None:
        """The session file, as read last."""
        return self.follower.view

    @property
    def driving(self) -> bool:
        """Whether this screen has control of the rig."""
        return self.client is not None and self.client.driving

    @property
    def model(self) -> Model:
        """What the pages are drawn from, now."""
        return seen.model(self)

    # ------------------------------------------------------------------ flow and pages

    async def _reached(self) -> None:
        """Go on where the daemon, or a new one, is."""
        assert self.client is not None
        if self.asked and self.client.driving and not self.client.state.section("session"):
            await doing.open_session(self, *self.asked)

    def event(self, event: Event) -> None:
        """Let the flow take an event, and have its effects carried out."""
        before = self.flow.stage
        self.flow, wanted = step(self.flow, event)
        if self.flow.stage is not before:
            self.since = monotonic()
        if self.flow.stage is Stage.RESULT and self.flow.job is not None:
            self.follower.judged.add(self.flow.job)
        for effect in wanted:
            self.run_worker(effects.carry_out(self, effect, self.flow.ticket), group="effects")

    async def _follow(self) -> None:
        """Show the page of the stage when the stage has changed."""
        stage = self.model.stage
        wanted = _PAGE_OF.get(stage, "run")
        if self.options.offline:
            wanted = "history"
        if wanted != self._followed and stage is not Stage.TESTING:
            self._followed = wanted
            await self.go(wanted)

    async def _load_pages(self) -> None:
        """Have ready what was not needed for the first paint."""
        for name in pages.NAMES:
            await asyncio.to_thread(pages.load, name)
        await asyncio.to_thread(pages.load_rest)

    @property
    def history(self) -> HistoryPage:
        """The page with the tape."""
        if "history" not in self.pages:
            self.pages["history"] = pages.load("history")()
        return cast("HistoryPage", self.pages["history"])

    async def go(self, page: str) -> None:
        """Show a page."""
        async with self._turning:  # the flow and a key may want a page at the same time
            if page not in self.pages:
                self.pages[page] = (await asyncio.to_thread(pages.load, page))()
            if not self._open():
                return
            switcher = self.screen_stack[0].query_one("#pages", ContentSwitcher)
            if not self.pages[page].is_mounted:
                await switcher.add_content(self.pages[page], id=page)
            if not self._open():
                return
            switcher.current = page
            self.page = page
        self.draw()

    # ------------------------------------------------------------------ keys and mouse

    async def on_event(self, event: events.Event) -> None:
        """Take keys before anybody else: STOP must work with focus anywhere."""
        key = event.key if isinstance(event, events.Key) and not event.is_forwarded else None
        if key is not None and keyboard.takes(self, key):
            event.stop()
            return
        await super().on_event(event)

    def action_do(self, name: str) -> None:
        """Do one action of the table, if it makes sense now."""
        action = BY_NAME[name]
        if self.client is None and name not in OFFLINE:
            return
        if not possible(action, self.flow.stage, driving=self.driving):
            if action.driving and not self.driving:
                self.event(Refused(self.flow.ticket, "this screen only watches\n"
                                   "c takes control when it is free"))  # fmt: skip
            return
        self.run_worker(doing.do(self, name), group="actions")

    def action_choose(self, page: str, at: int) -> None:
        """Choose a line of a page's list by mouse."""
        self.pages[page].choose(at)
        self.draw()

    def get_system_commands(self, screen: Screen[object]) -> Iterable[SystemCommand]:
        """Name every action that makes sense now."""
        del screen
        for action in ACTIONS:
            if self.client is None and action.name not in OFFLINE:
                continue
            if action.name != "palette" and possible(action, self.flow.stage, driving=self.driving):
                told = f"{shown_key(self.keys[action.name])}  {action.command}".rstrip()
                yield SystemCommand(
                    action.text, told, lambda name=action.name: self.action_do(name)
                )
