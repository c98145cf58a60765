"""Any drop of the session again, with the same indicators and plots, forwards and back."""

from __future__ import annotations

from dataclasses import replace
from statistics import mean, stdev
from typing import TYPE_CHECKING

from textual.containers import Horizontal, Vertical
from textual.content import Content

from rig.films import read_films
from rig.measurands import listed
from rig.reasons import notes_in
from rig.report.numbers import fixed
from rig.tui.choosing import chosen, condition
from rig.tui.motion import motions
from rig.tui.plots import drop_pictures, laid_over, run_picture
from rig.tui.replay import Player, end_of, indicators_at, until
from rig.tui.scale import drawing
from rig.tui.screens.page import Page
from rig.tui.screens.result import number_table
from rig.tui.widgets.banner import LOOKS
from rig.tui.widgets.chains import ChainView
from rig.tui.widgets.figure import Figure
from rig.tui.widgets.gates import GateBoard
from rig.tui.widgets.text import Words, plain

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from textual.app import ComposeResult

    from rig.records import Job
    from rig.results.live import SessionView
    from rig.tui.context import Options
    from rig.tui.indicators import Indicators
    from rig.tui.model import Model


class HistoryPage(Page):
    """A drop played again."""

    SCOPED_CSS = False
    DEFAULT_CSS = """
    HistoryPage #left, HistoryPage #right { width: 1fr; }
    HistoryPage #numbers { padding: 1 1 0 1; }
    .-narrow HistoryPage #left { display: none; }
    .-low HistoryPage #numbers { display: none; }
    """

    def __init__(self, options: Options) -> None:
        super().__init__(options)
        self.player = Player()
        self.other: SessionView | None = None
        """Of another session than the one in hand."""
        self.words = ""
        """Which drops are looked at, as `rig.tui.choosing` reads them."""
        self.comparing = False
        """Whether all drops that are looked at lie over each other."""
        self._view: SessionView | None = None

    def compose(self) -> ComposeResult:
        yield Words(id="which")
        with Horizontal():
            with Vertical(id="left"):
                yield GateBoard(id="indicators")
                yield Words(id="numbers")
            yield ChainView(id="chains")
            with Vertical(id="right"):
                yield Figure(id="z")
                yield Figure(id="dz")

    # ------------------------------------------------------------------ the tape

    @property
    def view(self) -> SessionView | None:
        """What is played; `None` without a drop."""
        return self._view if self._view and self._view.jobs else None

    @property
    def job(self) -> Job | None:
        """The drop that is played."""
        return self.jobs[self.player.at % len(self.jobs)] if self.jobs else None

    @property
    def jobs(self) -> tuple[Job, ...]:
        """The drops that are looked at."""
        view = self.view
        if view is None:
            return ()
        key = view.path, view.reading, self.words
        return self.latest("jobs", key, lambda: chosen(view, self.words))

    def sift(self, words: str) -> None:
        """Look at some drops only."""
        self.words = words
        self.player = replace(self.player, at=0, time_s=0.0)

    def tick(self, seconds: float) -> None:
        """Let time pass while playing."""
        if self.player.playing:
            self.player = self.player.ticked(seconds, self._end_s)

    def change(self, change: Callable[[Player, float], Player]) -> None:
        """Change how the drop is played, knowing when it ends (s)."""
        self.player = change(self.player, self._end_s)

    def move(self, by: int) -> None:
        """Take another drop."""
        if self.jobs:
            self.player = self.player.other(by, len(self.jobs))

    def choose(self, at: int) -> None:
        """Take one drop of the list."""
        self.move(at - self.player.at)

    @property
    def _end_s(self) -> float:
        view, job = self.view, self.job
        return end_of(view.drops[job], view.scales[job].hz) if view and job else 0.0

    # ------------------------------------------------------------------ drawing

    def show(self, model: Model) -> None:
        """Draw the drop at its moment."""
        self._view = self.other or model.view
        view, job = self.view, self.job
        if view is None or job is None:
            self._blank()
            missing = model.loading or "No drop recorded yet. Press o to choose another session."
            if view is not None:
                missing = f"No drop matches {plain(self.words, 40)}. Press f to change this."
            self.say("which", missing)
            return
        self.say("which", _which(view, job, self))
        drop, hz = view.drops[job], view.scales[job].hz
        seen = until(drop.edges, hz, self.player.time_s)
        indicators = indicators_at(view.channels, drop, seen)
        self.query_one(GateBoard).show(view.protocol, indicators, 0.0)
        self._draw_chains(view, job, indicators)
        jobs, now_ms = self.jobs, self.player.time_s * 1e3
        if self.comparing:
            self.draw(
                (view.path, job, hz, jobs),
                lambda: (run_picture(view, jobs, job), laid_over(view, jobs, job)),
            )
        else:
            self.draw((view.path, job, hz, len(seen)), lambda: drop_pictures(view, job, seen))
        self.query_one("#z", Figure).point_at(None if self.comparing else now_ms)
        self.query_one("#dz", Figure).point_at(now_ms)
        table = self.latest(
            "numbers",
            (view.path, view.reading, job, self.comparing and jobs),
            lambda: comparison(view, jobs) if self.comparing
            else number_table(view, job, wide=False),
        )  # fmt: skip
        self.say("numbers", table)

    def _draw_chains(self, view: SessionView, job: Job, indicators: Indicators) -> None:
        """Draw both chains at the moment of the tape, from all edges of the drop."""
        run, hz = view.plan[job.run], view.scales[job].hz
        edges, matches = view.drops[job].edges, view.results[job].matches or None
        falls, film = self.latest(
            "falls",
            (view.path, job, hz),
            lambda: (
                motions(view.protocol, run, edges, hz, matches),
                read_films(view.path).get(job),
            ),
        )
        chains = drawing(view.protocol, run, falls, indicators, self.player.time_s, film)
        self.query_one(ChainView).show(chains)

    def _blank(self) -> None:
        self.query_one(ChainView).show(None)
        self.say("numbers", "")
        self.query_one(GateBoard).take([])
        self.draw(None, lambda: (None, None))


def comparison(view: SessionView, jobs: Sequence[Job]) -> Content:
    """Write mean and standard deviation of what some drops measured."""
    lines = [Content.styled(f"{'':15}{'n':>4}{'mean':>9}{'SD':>9}", "bold")]
    for row in listed():
        values = [
            found.value * row.scale
            for job in jobs
            if (found := view.results[job].quantities.get(row.name)) is not None
        ]
        if values:
            scatter = fixed(stdev(values), 3) if len(values) > 1 else "–"
            line = (
                f"{row.label:15}{len(values):4}{fixed(mean(values), 3):>9}{scatter:>9} {row.unit}"
            )
            lines.append(Content(line))
    return Content("\n").join(lines)


def _which(view: SessionView, job: Job, page: HistoryPage) -> Content:
    player = page.player
    run, result = view.plan[job.run], view.results[job]
    symbol, colour = LOOKS.get(result.verdict, ("?", "$foreground"))
    place = page.jobs.index(job) + 1
    only = f" ({plain(page.words, 40)})" if page.words else ""
    reasons = (line.reasons for line in reversed(view.states) if (line.run, line.attempt) == job)
    note = "".join(f"\nnote: {plain(text, 160)}" for text in notes_in(next(reasons, ())))
    arrow = "◀" if player.back else "▶"
    state = f"{arrow} playing" if player.playing else f"‖ paused {arrow}"
    speed = f"{player.speed:g} ×" if player.speed >= 1 else f"1/{1 / player.speed:g} ×"
    stamp = "  ▲ SIMULATED" if view.simulated else ""
    return Content.assemble(
        (f"drop {place} of {len(page.jobs)}{only}", "bold $primary"),
        f"  run {job.run}, attempt {job.attempt} · {condition(run)} · ",
        (f"{symbol} {result.verdict}", colour),
        f"\n{state} at {speed} real speed, t = {player.time_s * 1e3:.0f} ms · ",
        (plain(view.path.name, 60), "$foreground 70%"),
        (stamp, "bold $warning"),
        (note, "bold"),
    )
