"""The terminal app: clock, flow of the campaign, and pages."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Hashable, Iterator, Mapping, Sequence
from importlib import import_module
from time import monotonic, process_time
from typing import Any

from textual import events
from textual.app import App, ComposeResult
from textual.content import Content
from textual.filter import LineFilter
from textual.theme import Theme
from textual.widgets import Input

from rig.campaign import machine as campaign
from rig.campaign.machine import BEFORE_RELEASE, Flow, Stage
from rig.errors import RigError
from rig.reasons import rig_error
from rig.text_rows import read_rows
from rig.tui import commands
from rig.tui.actions import BY_NAME, PAGES
from rig.tui.ascii import AsciiFilter
from rig.tui.client import ReconnectingClient
from rig.tui.context import Options
from rig.tui.desk import Desk, Face
from rig.tui.driver import Driver
from rig.tui.follow import Follower
from rig.tui.model import Model
from rig.tui.stillness import Stillness
from rig.tui.terminal import Terminal
from rig.tui.widgets.bars import headline, hints, problem, stop_line, tabs
from rig.tui.widgets.dialogs import Ask, Confirm, Dialog, TextDialog
from rig.tui.widgets.page import Page
from rig.tui.widgets.text import Words, plain

TICK_S = 0.1
_LEAST_S = 0.01  # least time between ticks, after a late tick
_LOOK_S = 2.0  # time between two scans of folder and USB
_COUNTED_S = 0.3
"""Most that a tick takes off a countdown: after a late tick, keys may still be waiting."""
_TOLD_S = 15.0
_SHARE = 0.18  # share of a core that the app may use for long
_SAVED_S = 0.1  # processor time that a fall may use beyond that
_PAGE_OF = {stage: page for page, _, stages, _ in PAGES for stage in stages.split()}
_HEIGHTS = [(0, "-low"), (30, "-high")]
"""Classes of a screen by its least number of lines."""


def _themes() -> Iterator[Theme]:
    (_, *parts), *columns = zip(*read_rows(__file__, "themes.txt", None), strict=True)
    for name, *values in columns:
        colours: dict[str, Any] = dict(zip(parts, values, strict=True))
        edges = dict.fromkeys(("border", "border-blurred"), colours.pop("border"))
        yield Theme(name=f"rig-{name}", dark=name != "light", variables=edges, **colours)


THEMES = tuple(_themes())


class RigApp(App[None], inherit_bindings=False):
    """The lab session.

    Parameters
    ----------
    options
        Options of the command line.
    keys
        Keys of every action, by name.
    client
        Client of the daemon, if not that of the options.
    loaded
        Called when all modules that a session needs are loaded.
    """

    TITLE = "chainrig"
    CSS_PATH = "rig.tcss"
    ENABLE_COMMAND_PALETTE = False  # our own palette lists only possible actions
    VERTICAL_BREAKPOINTS = _HEIGHTS

    def __init__(
        self,
        options: Options,
        keys: Mapping[str, str],
        client: ReconnectingClient | None = None,
        loaded: Callable[[], object] = lambda: None,
    ) -> None:
        super().__init__(driver_class=Terminal)
        self.options = options
        self.keys: Mapping[str, str] = keys
        self.action_of = {key: name for name, text in keys.items() for key in text.split(",")}
        # Offline it is never connected.
        self.client = client or ReconnectingClient(options.port, options.socket, self._resume)
        self._loaded = loaded
        start = Stage.DONE if options.offline else Stage.PROTOCOL
        flow = Flow(stage=start, countdown_s=options.countdown_s)
        self.model = Model(self.client, flow, options.offline)
        self.follower = Follower(self.model, self.begin)
        self.driver: Driver = Driver(self.model, self.follower, self.begin)
        self.desk = Desk(options)
        self._faces: dict[str, Callable[[Model, Desk], Face]] = {}
        self._looked_s = 0.0
        self._stillness = Stillness(options.still_s)
        self._last = self._due = monotonic()
        self._spent, self._saved_s = process_time(), _SAVED_S
        self._told, self._told_s = "", 0.0
        self._followed = ""
        self._rang_at = start
        for theme in THEMES:
            self.register_theme(theme)
        self.theme = THEMES[0].name

    def get_line_filters(self) -> Sequence[LineFilter]:
        """Return the filters applied to every line drawn."""
        return [*super().get_line_filters(), *[AsciiFilter()] * self.options.ascii]

    # ------------------------------------------------------------------ life

    def compose(self) -> ComposeResult:
        yield from (Words(id=name) for name in ("headline", "tabs", "problem", "told"))
        yield Page()
        yield from (Words(id=name) for name in ("hints", "stop"))

    async def on_mount(self) -> None:
        if not self.options.offline:
            self.run_worker(self.client.keep(), group="client")
        elif self.options.session is not None:
            self.begin(self.follower.show_file(self.options.session))
        self._follow()
        self.set_timer(TICK_S, self._tick)
        self.call_after_refresh(lambda: self.begin(self._load_pages()))

    def on_unmount(self) -> None:
        self.client.end_trial()

    def begin(self, work: commands.Work) -> None:
        """Run a coroutine, if any, in the background, and show its error if it fails."""
        if work is not None:
            self.run_worker(self._try(work), group="beside")

    async def _try(self, work: Coroutine[Any, Any, object]) -> None:
        try:
            await work
        except RigError as error:
            self.driver.take(campaign.effect_failure(self.model.flow.ticket, error))

    async def _tick(self) -> None:
        # Ten times a second, or down to five if that takes too much processor time for long.
        now, spent = monotonic(), process_time()
        passed, self._last = now - self._last, now
        took, self._spent = spent - self._spent, spent
        self._saved_s = min(_SAVED_S, self._saved_s + _SHARE * passed - took)
        pause = TICK_S if self._saved_s > 0.0 else max(TICK_S, took / _SHARE)
        self._due = max(now + _LEAST_S, self._due + min(pause, 2 * TICK_S))
        self.set_timer(self._due - now, self._tick)
        if not self._open():
            return
        self._stillness.alive(now)
        self.driver.take(campaign.Tick(min(passed, _COUNTED_S)))
        self.desk.tick(self.model, passed)
        if self.model.flow.stage is Stage.PROTOCOL and now - self._looked_s >= _LOOK_S:
            self._looked_s = now
            self.begin(self._look_around())
        if self.client.changed and not self.options.offline:
            self.client.changed = False
            for event in [*self.follower.absorb(reopens=self.driver.asked is not None)]:
                self.driver.take(event)
        while self.model.hot and len(self.screen_stack) > 1:
            self.screen.dismiss(None)
        self._follow()
        self.draw()

    def _open(self) -> bool:
        """Whether there is a screen that is not being closed."""
        return self.is_running and bool(self.screen_stack) and self.screen_stack[0].is_attached

    def draw(self) -> None:
        """Draw all changes since the last drawing."""
        if not self._open() or not self.screen_stack[0].query("#stop"):
            return  # the screen is opening or closing
        model, width = self.model, self.size.width - 2
        wrong, is_told = problem(model), monotonic() - self._told_s < _TOLD_S
        lines: dict[str, Content | str] = {
            "headline": headline(model, width),
            "tabs": tabs(model.page, self.keys),
            "problem": wrong,
            "told": plain(self._told, 240) if is_told and not wrong else "",
            "hints": hints(model, self.keys, width),
            "stop": stop_line(model, self.keys),
        }
        for screen in self.screen_stack:
            screen.set_class(model.hot, "-hot")
            for words in screen.query(Words):
                if words.id in lines:
                    words.say(lines[words.id])
        if model.page in self._faces:
            self.desk.width = self.sheet.tables_width()
            face = self._faces[model.page](model, self.desk)
            self.sheet.show(face, self.desk)
        # The operator sees a drawing only after the refresh.
        self.call_after_refresh(self._stillness.shown, self._face)

    @property
    def _face(self) -> Hashable:
        """Return the part of the view on which the meaning of a key depends."""
        flow = self.model.flow
        return self.model.page, flow.stage, flow.job, self.client.driving, id(self.screen)

    # ------------------------------------------------------------------ flow and pages

    async def _resume(self) -> None:
        """Continue after the daemon, or a new one, was reached."""
        if self.driver.asked and self.client.driving and not self.client.state.section("session"):
            await self._try(self.driver.open_session(*self.driver.asked, self.options.seed))

    def _follow(self) -> None:
        """Show the page of the stage when the stage has changed."""
        stage = self.model.stage
        ends = stage is not self._rang_at and stage in {Stage.RESULT, Stage.HALTED}
        if ends and self.options.bell:
            self.bell()
        self._rang_at = stage
        page_wanted = "history" if self.options.offline else _PAGE_OF.get(stage, "run")
        if page_wanted != self._followed and stage is not Stage.TESTING:
            self._followed = page_wanted
            self.turn(page_wanted)

    async def _load_pages(self) -> None:
        """Load modules that were not needed for the first paint."""
        for page, module, *_ in PAGES:
            loaded = await asyncio.to_thread(import_module, f"rig.tui.pages.{module}")
            self._faces[page] = loaded.face
            self.draw()
        self._loaded()

    @property
    def sheet(self) -> Page:
        """Widget on which pages are drawn."""
        return self.screen_stack[0].query_one(Page)

    def turn(self, page: str) -> None:
        """Show a page, beginning with its first part."""
        self.model.page = page
        self.desk.part = self.desk.chart = 0
        if self._open():
            self.sheet.rewind()
        self.draw()

    def turn_on(self, part: int = 0, chart: int = 0) -> None:
        """Show another part of the page, or another plot, first."""
        self.desk.part += part
        self.desk.chart += chart
        self.draw()

    async def _look_around(self) -> None:
        """Update the list of the home page: sessions, protocols and boards."""
        survey = await asyncio.to_thread(import_module, "rig.tui.survey")
        rows = await asyncio.to_thread(survey.look_around, self.options, self.client)
        self.desk.begin_with(rows)
        self.draw()
        if self.desk.opens_first and self.model.page == "protocol":
            self.action_do("go_on")
        self.desk.opens_first = False

    def ask(self, question: Dialog, act: Callable[[Any], commands.Work] = lambda _: None) -> None:
        """Open a dialog, and act on the answer; no dialog opens while a chain may fall."""
        if not self.model.hot:
            self.push_screen(
                question, lambda answer: self.begin(None if answer is None else act(answer))
            )
            self.draw()

    def tell(self, text: str) -> None:
        """Show a message for some time, on any page."""
        self._told, self._told_s = text, monotonic()
        self.draw()

    def next_theme(self) -> None:
        """Switch to the next colour theme."""
        following = THEMES.index(self.current_theme) + 1
        self.theme = THEMES[following % len(THEMES)].name

    # ------------------------------------------------------------------ keys and mouse

    async def on_event(self, event: events.Event) -> None:
        """Handle keys before any widget: STOP must work with focus anywhere."""
        taken, typed = False, isinstance(event, (events.InputEvent, events.Paste))
        if typed and not self.screen_stack:  # the terminal has ended
            return
        if typed and not event.is_forwarded:
            if isinstance(event, events.Key):
                taken = self._takes(event.key, event.time)
            elif isinstance(event, events.Paste):
                taken = self._ends_countdown()
            if isinstance(event, (events.Key, events.Paste, events.MouseDown)):
                self._stillness.note_input(event.time)
        if taken:
            event.stop()
        else:
            await super().on_event(event)

    def _takes(self, key: str, at_s: float) -> bool:
        """Handle a key, STOP first; return whether it had a meaning.

        Keys are handled synchronously and in order; slow work starts in the background.
        """
        name, screen = self.action_of.get(key), self.screen
        if name == "stop" or (key == "escape" and not isinstance(self.focused, Input)):
            self.driver.take(campaign.StopRequest())
            if isinstance(screen, Dialog) and (
                not isinstance(screen, Ask)
                or (key == "escape" and screen.is_mounted)  # a click has left its field
            ):
                screen.dismiss(None)
            return True
        if self._ends_countdown():
            return True
        if isinstance(screen, Dialog):
            return self._answers(screen, key, at_s)
        if key == "enter" and self.model.page == "run" and self.model.flow.stage is Stage.PREPARE:
            self._arm(at_s)
        elif name is not None:
            self.action_do(name)
        return name is not None

    def _ends_countdown(self) -> bool:
        """Stop a countdown to a release; return whether there was any."""
        if self.model.flow.stage not in BEFORE_RELEASE:
            return False
        self.driver.take(campaign.StopRequest())
        return True

    def _answers(self, dialog: Dialog, key: str, at_s: float) -> bool:
        """Let a key answer a dialog; return whether it did."""
        if isinstance(dialog, Ask):  # its field takes all but an Enter pasted with what opened it
            return key == "enter" and not self._stillness.read(self._face, at_s)
        if isinstance(dialog, TextDialog) and key in {"up", "down"}:
            return False
        if not isinstance(dialog, Confirm) or key != "enter":
            dialog.dismiss(None)
        elif self._stillness.meant(self._face, at_s):
            dialog.dismiss(True)
        return True

    def _arm(self, at_s: float) -> None:
        """Arm the release; the app arms only here.

        Requires an Enter by itself: the run page was still, and no other key was pressed.
        """
        if not self.client.driving:
            self.action_do("go_on")  # which shows the reason
        elif self._stillness.meant(self._face, at_s):
            self.driver.take(campaign.GoOn(self.model.next_job, self.model.settle_s))
        else:
            self.driver.take(campaign.Notice(rig_error("enter_too_soon").two_lines))

    def action_do(self, name: str) -> None:
        """Do an action of the table, if it is possible now."""
        action = BY_NAME[name]
        if self.model.allows(action):
            self.begin(commands.DO[name](self))
        elif action.driving and not self.client.driving and not self.options.offline:
            watching = rig_error("only_watching")
            self.driver.take(campaign.effect_failure(self.model.flow.ticket, watching))

    def action_choose(self, at: int) -> None:
        """Select a row of the home page."""
        self.desk.row = at
        sections = {row.section for row in self.desk.rows[: at + 1]}
        self.sheet.show_row(at + len(sections))
        self.draw()
