"""Any drop of the session again, with the same lamps and plots, forwards and back."""

from __future__ import annotations

from typing import TYPE_CHECKING

from textual.containers import Horizontal, Vertical
from textual.content import Content

from rig.tui.plots import chain_pictures
from rig.tui.replay import Player, end_of, lamps_at, until
from rig.tui.screens.page import Page
from rig.tui.screens.result import number_table
from rig.tui.widgets.banner import LOOKS
from rig.tui.widgets.figure import Figure
from rig.tui.widgets.lamps import LampBoard
from rig.tui.widgets.text import Words
from rig.tui.words import plain

if TYPE_CHECKING:
    from textual.app import ComposeResult

    from rig.tui.findings import Findings
    from rig.tui.model import Model
    from rig.tui.plan import Job


class HistoryPage(Page):
    """A drop played again."""

    NAME = "history"
    SCOPED_CSS = False
    DEFAULT_CSS = """
    HistoryPage #which { height: auto; padding: 0 1; }
    HistoryPage #left { width: 1fr; }
    HistoryPage #right { width: 1fr; }
    HistoryPage #numbers { height: auto; padding: 1 1 0 1; }
    .-narrow HistoryPage #left { display: none; }
    .-low HistoryPage #numbers { display: none; }
    """

    def __init__(self) -> None:
        super().__init__()
        self.player = Player()

    def compose(self) -> ComposeResult:
        yield Words(id="which")
        with Horizontal():
            with Vertical(id="left"):
                yield LampBoard(id="lamps")
                yield Words(id="numbers")
            with Vertical(id="right"):
                yield Figure(id="z")
                yield Figure(id="dz")

    def tick(self, seconds: float, findings: Findings | None) -> None:
        """Let time pass while playing."""
        if self.player.playing and findings is not None and findings.jobs:
            self.player = self.player.ticked(seconds, self._end(findings))

    def play(self, findings: Findings | None) -> None:
        """Play, or stand still; at the end, from the beginning."""
        if findings is None or not findings.jobs:
            return
        player = self.player
        at_end = player.time_s >= self._end(findings)
        start = 0.0 if at_end else player.time_s
        self.player = Player(player.at, start, player.speed, not player.playing)

    def _end(self, findings: Findings) -> float:
        job = self._job(findings)
        return end_of(findings.drops[job], findings.scales[job].hz)

    def _job(self, findings: Findings) -> Job:
        return findings.jobs[self.player.at % len(findings.jobs)]

    def show(self, model: Model) -> None:
        """Draw the drop at its moment."""
        findings = model.findings
        words, z, dz = (
            self.query_one("#which", Words), self.query_one("#z", Figure),
            self.query_one("#dz", Figure),
        )  # fmt: skip
        numbers = self.query_one("#numbers", Words)
        if findings is None or not findings.jobs:
            words.say("No drop is recorded yet.")
            z.show(None)
            dz.show(None)
            return
        job = self._job(findings)
        if model.blindfold and job == model.flow.job:
            words.say("This drop is blind: its numbers come with your decision.")
            numbers.say("")
            z.show(None)
            dz.show(None)
            return
        words.say_content(_which(findings, job, self.player))
        drop, hz = findings.drops[job], findings.scales[job].hz
        seen = until(drop.edges, hz, self.player.time_s)
        channels = tuple(lamp.channel for lamp in model.lamps.lamps) or tuple(
            gate.channel for gate in findings.protocol.gates.gates
        ) if findings.protocol.gates else ()  # fmt: skip
        board = self.query_one(LampBoard)
        board.show(findings.protocol, lamps_at(channels, drop, seen), 0.0)
        key = (findings.path, job, hz, len(seen))
        if z.wants(key):
            matches = findings.results[job].matches or None
            run = findings.plan[job.run]
            first, second = chain_pictures(findings.protocol, run, seen, hz, matches)
            z.show(first, key)
            dz.show(second, key)
        numbers.say_content(number_table(findings, job, wide=False))


def _which(findings: Findings, job: Job, player: Player) -> Content:
    run, result = findings.plan[job.run], findings.results[job]
    symbol, colour = LOOKS.get(result.verdict, ("?", "$foreground"))
    hung = f"{run.incline_deg:g}° impact {plain(run.impact, 20)}" if run.impact else "free fall"
    place = findings.jobs.index(job) + 1
    state = "▶ playing" if player.playing else "‖ still"
    speed = f"×{player.speed:g}" if player.speed >= 1 else f"1/{1 / player.speed:g} of"
    return Content.assemble(
        (f"drop {place} of {len(findings.jobs)}", "bold $primary"),
        f"  run {job.run}, attempt {job.attempt} · {hung} · ",
        (f"{symbol} {result.verdict}", colour),
        f"\n{state} at {speed} real speed, t = {player.time_s * 1e3:.0f} ms",
    )
