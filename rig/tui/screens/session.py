"""The session so far: the plan with its states, results against incline, the control chart."""

from __future__ import annotations

from itertools import groupby, zip_longest
from pathlib import Path
from typing import TYPE_CHECKING

from textual.containers import Grid, VerticalScroll
from textual.content import Content

from rig.analysis.joint_fit import FEWEST
from rig.campaign.plan import done
from rig.measurands import averaged
from rig.protocol.protocol import Condition
from rig.report.numbers import fixed, plus_minus
from rig.report.parts import main_error
from rig.tui.plots import control_pictures, inclined, meaning
from rig.tui.screens.page import Page
from rig.tui.widgets.banner import LOOKS
from rig.tui.widgets.figure import Figure
from rig.tui.widgets.text import Words, duration, plain

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from textual.app import ComposeResult

    from rig.analysis.summary import Incline
    from rig.campaign.plan import RunLine
    from rig.tui.context import Options
    from rig.tui.model import Model


_FIGURES = ("separation", "speed", "control", "second")


class SessionPage(Page):
    """Plan, results against incline, control chart."""

    SCOPED_CSS = False
    DEFAULT_CSS = """
    SessionPage #plan { height: auto; max-height: 8; padding: 0 1; }
    .-wide SessionPage #plan { max-height: 24; }
    SessionPage #figures { height: 1fr; grid-size: 2 2; grid-rows: 3fr 2fr; }
    SessionPage #meaning { color: $foreground 80%; }
    SessionPage #control { column-span: 2; }
    .-low SessionPage #figures { grid-size: 2 1; grid-rows: 1fr; }
    .-low SessionPage #control, .-wide SessionPage #control { column-span: 1; }
    .-wide SessionPage #figures { grid-rows: 1fr 1fr; }
    .-low SessionPage #plan { max-height: 5; }
    """

    def __init__(self, options: Options) -> None:
        super().__init__(options)
        self._chart = 0

    def compose(self) -> ComposeResult:
        yield Words(id="progress")
        with VerticalScroll(id="plan", can_focus=False):
            yield Words(id="lines")
        with Grid(id="figures"):
            for name in _FIGURES:
                yield Figure(id=name)
        yield Words(id="meaning")

    def show(self, model: Model) -> None:
        """Draw what holds now."""
        self.say("progress", _progress(model))
        self.say("lines", _plan(model))
        figures = [self.query_one(f"#{name}", Figure) for name in _FIGURES]
        view = model.view
        if view is None:
            for figure in figures:
                figure.show(None)
            return
        low, wide = self.screen.has_class("-low"), self.screen.has_class("-wide")
        key = (view.path, view.reading, self._chart, low, wide)
        if not any(figure.wants(key) for figure in figures):
            return
        means, charts = inclined(view.analysis, view.curves), control_pictures(view)
        turned = [*charts[self._chart % len(charts) :], *charts] if charts else []
        speed = [] if low else means[1:2]  # no room for both; Δz says more
        charted = charts[:2] if wide else turned[:1]
        self.say("meaning", "\n".join(meaning(picture.y_label) for picture in charted))
        for figure, data in zip(figures, (means[:1], speed, charted[:1], charted[1:]), strict=True):
            figure.show(next(iter(data), None), key)

    def other_chart(self) -> None:
        """Show the other quantity in the control chart."""
        self._chart += 1

    def move(self, by: int) -> None:
        """Scroll the plan."""
        self.query_one("#plan", VerticalScroll).scroll_relative(y=by, animate=False)


def _progress(model: Model) -> Content:
    if model.loading:
        return Content(model.loading)
    runs = model.state.runs
    voids = model.voids.counts(runs)
    over = sum(done(line, voids.get(line.run, 0)) for line in runs)
    if not runs:
        return Content("No session is open.")
    width = 24
    filled = round(width * over / len(runs))
    pace = model.view.pace_s if model.view else None
    remaining = (
        f" · about {duration(pace * (len(runs) - over))} left" if pace and over < len(runs) else ""
    )
    session = plain(Path(str(model.state.section("session").get("path", ""))).name, 60)
    return Content.assemble(
        ("━" * filled, "$success"), ("─" * (width - filled), "$foreground 40%"),
        (f"  {over} of {len(runs)} runs", "bold"), f"{remaining}  ", (session, "$foreground 70%"),
        _fit_words(model),
    )  # fmt: skip


def _plan(model: Model) -> Content:
    """One line an incline and, of unlike chains, striker: a symbol a run, and the means so far."""
    unlike = model.protocol is not None and model.protocol.unlike_chains

    def condition(line: RunLine) -> Condition:
        return Condition(line.incline_deg, line.impact if unlike else None)

    summary = {}
    if model.view is not None:
        summary = {line.condition: line for line in model.view.analysis.summary}
    ordered = sorted(model.state.runs, key=condition)
    groups = [list(group) for _, group in groupby(ordered, key=condition)]
    means = [_means(summary.get(condition(group[0]))) for group in groups]
    longest = max(map(len, groups), default=0)
    widths = [max(map(len, column)) for column in zip_longest(*means, fillvalue="")]
    lines = []
    for group, parts in zip(groups, means, strict=True):
        padded = [part.ljust(width) for part, width in zip(parts, widths, strict=False)]
        marks = [*_marks(group, model), (" " * (longest - len(group) + 2), "")]
        head = f"{group[0].incline_deg:5g}° " if group[0].impact is not None else "drops  "
        head += f"{plain(group[0].impact, 12)} " if unlike and group[0].impact else ""
        lines.append(Content.assemble((head, "bold"), *marks, "  ".join(padded).rstrip()))
    return Content("\n").join(lines)


def _fit_words(model: Model) -> tuple[str, str]:
    """Say whether the means come from a joint fit."""
    view = model.view
    if view is None or not view.analysis.summary:
        return "", ""
    suffix = " · adding the newest …" if view.lagging else ""
    if view.fitted:
        return f"\njoint fit of {view.fitted} runs{suffix}", "$foreground 70%"
    joint = f"; joint fit from {FEWEST} good drops on" if not suffix else ""
    return f"\neach drop fitted alone{joint}{suffix}", "$foreground 70%"


def _marks(runs: Sequence[RunLine], model: Model) -> Iterator[tuple[str, str]]:
    """A symbol a run; the one that is on turns its colours round."""
    for line in runs:
        is_now = model.job is not None and line.run == model.job.run
        symbol, colour = LOOKS.get(line.state, ("?", "$foreground"))
        yield symbol, f"{colour} reverse" if is_now else colour


def _means(line: Incline | None) -> list[str]:
    """What is known of an incline so far."""
    if line is None:
        return []
    parts = [
        f"{row.symbol} {plus_minus(line.means[row.name], row.scale)} {row.unit}"
        for row in averaged()
        if row.name in line.means
    ]
    error = main_error(line)
    return parts if error is None else [*parts, f"Eₙ {fixed(error, 2)}"]
