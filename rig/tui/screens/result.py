"""The latest drop: verdict, numbers beside the model, edges, and both chains' way down."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from textual.containers import Horizontal
from textual.content import Content

from rig.analysis.distributions import coverage_factor
from rig.analysis.result import Measured
from rig.measurands import RELEASE_SKEW, listed
from rig.predictions import predicted_run
from rig.report.numbers import fixed, plus_minus
from rig.tui.plots import chain_pictures
from rig.tui.screens.page import Page
from rig.tui.widgets.banner import Banner
from rig.tui.widgets.figure import Figure
from rig.tui.widgets.text import Words

if TYPE_CHECKING:
    from textual.app import ComposeResult

    from rig.records import Job
    from rig.results.live import SessionView
    from rig.tui.model import Model
    from rig.tui.widgets.figure import Picture
    from rig.units import Quantity


class ResultPage(Page):
    """Everything one drop says."""

    NAME = "result"
    SCOPED_CSS = False
    DEFAULT_CSS = """
    ResultPage #numbers { height: auto; padding: 0 1; }
    ResultPage #figures { height: 1fr; }
    """

    def compose(self) -> ComposeResult:
        yield Banner(id="banner")
        yield Words(id="numbers")
        with Horizontal(id="figures"):
            yield Figure(id="z")
            yield Figure(id="dz")

    def show(self, model: Model) -> None:
        """Draw what holds now."""
        self.query_one(Banner).show(model)
        view, job = model.view, model.job
        ready = view is not None and job in view.results and not model.blindfold
        numbers = self.query_one("#numbers", Words)
        numbers.display = ready
        z, dz = self.query_one("#z", Figure), self.query_one("#dz", Figure)
        if not ready or view is None or job is None:
            z.show(None)
            dz.show(None)
            return
        numbers.say_content(number_table(view, job))
        key = (view.path, job, view.scales[job].hz)
        if z.wants(key):
            first, second = drop_pictures(view, job)
            z.show(first, key)
            dz.show(second, key)


def drop_pictures(view: SessionView, job: Job) -> tuple[Picture | None, Picture | None]:
    """Draw a recorded drop, with the rods as the analysis found them."""
    matches = view.results[job].matches or None
    run, edges = view.plan[job.run], view.drops[job].edges
    return chain_pictures(view.protocol, run, edges, view.scales[job].hz, matches)


def number_table(view: SessionView, job: Job, *, wide: bool = True) -> Content:
    """Write the numbers with U95; where there is room, the model's and the normalized error too."""
    result = view.results[job]
    expected = predicted_run(view.protocol, view.plan[job.run])
    head = f"{'':15}{'measured ± U95':>20}"
    lines = [Content.styled(f"{head}{'model ± U95':>21}     Eₙ" if wide else head, "bold")]
    for row in listed():
        measured = result.quantities.get(row.name)
        if measured is None:
            continue
        line = f"{row.label:15}{plus_minus(measured, row.scale):>20} {row.unit:4}"
        model = expected.get(row.name)
        if not wide:
            pass
        elif model is not None:
            told = Measured(model.value, model.u) if model.u else model.value
            line += f"{plus_minus(told, row.scale):>16}"
            line += f"   {fixed(_normalized(measured, model), 2):>5}"
        elif row == RELEASE_SKEW:
            limit = view.protocol.accept.release_skew * row.scale
            line += f"{f'limit ±{limit:g}':>16}"
        lines.append(Content(line))
    counts = " · ".join(f"{kind} {count}" for kind, count in result.audit.json().items())
    lines.append(Content(f"{'edges':15}{counts}"))
    return Content("\n").join(lines)


def _normalized(measured: Measured, model: Quantity) -> float | None:
    width = math.hypot(measured.expanded, coverage_factor(math.inf) * model.u)
    return (measured.value - model.value) / width if width > 0.0 else None
