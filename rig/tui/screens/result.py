"""The latest drop: verdict, numbers beside the model, edges, and both chains' way down."""

from __future__ import annotations

from typing import TYPE_CHECKING

from textual.containers import Horizontal
from textual.content import Content

from rig.analysis.comparison import compare
from rig.measurands import RELEASE_SKEW, listed
from rig.predictions import predicted_run
from rig.report.numbers import fixed, plus_minus
from rig.tui.plots import drop_pictures
from rig.tui.screens.page import Page
from rig.tui.why import speed_picture, stated, why_words
from rig.tui.widgets.banner import verdict_words
from rig.tui.widgets.figure import Figure
from rig.tui.widgets.text import Words

if TYPE_CHECKING:
    from textual.app import ComposeResult

    from rig.records import Job
    from rig.results.live import SessionView
    from rig.tui.model import Model
    from rig.tui.plotting import Picture


class ResultPage(Page):
    """Everything one drop says."""

    SCOPED_CSS = False
    DEFAULT_CSS = """
    ResultPage #banner { margin: 0 0 1 0; }
    ResultPage #why { padding: 1 1 0 1; }
    ResultPage.-unknown #why, .-low ResultPage #why { display: none; }
    ResultPage #figures { height: 1fr; }
    """

    def compose(self) -> ComposeResult:
        yield Words(id="banner")
        yield Words(id="numbers")
        yield Words(id="why")
        with Horizontal(id="figures"):
            yield Figure(id="z")
            yield Figure(id="dz")

    def show(self, model: Model) -> None:
        """Draw what holds now."""
        self.say("banner", verdict_words(model))
        view, job = model.view, model.job
        ready = view is not None and job in view.results
        self.query_one("#numbers").display = ready
        self.set_class(not ready, "-unknown")
        if not ready or view is None or job is None:
            self.draw(None, lambda: (None, None))
            return
        key = view.path, view.reading, job
        self.say("numbers", self.latest("numbers", key, lambda: number_table(view, job)))
        self.say("why", self.latest("why", key, lambda: why_words(view, job)))
        self.draw((view.path, job, view.scales[job].hz), lambda: _pictures(view, job))


def _pictures(view: SessionView, job: Job) -> tuple[Picture | None, Picture | None]:
    heights, apart = drop_pictures(view, job)
    return speed_picture(view, job) or heights, apart


def number_table(view: SessionView, job: Job, *, wide: bool = True) -> Content:
    """Write the numbers with U95; where there is room, the model's and the normalized error too."""
    result = view.results[job]
    run = view.plan[job.run]
    expected = predicted_run(view.protocol, run)
    compared = compare(view.protocol, [[result]]) if wide else ()
    errors = {row.quantity: row.differences[0].normalized_error for row in compared}
    head = f"{'':15}{'measured ± U95':>20}"
    lines = [Content.styled(f"{head}{'model ± U95':>21}     Eₙ" if wide else head, "bold")]
    for row in listed():
        measured = result.quantities.get(row.name)
        if measured is None:
            continue
        line = f"{row.label:15}{plus_minus(measured, row.scale):>20} {row.unit:4}"
        model = expected.get(row.name)
        if wide and model is not None:
            line += f"{plus_minus(stated(model), row.scale):>16}"
            line += f"   {fixed(errors.get(row.name), 2):>5}"
        elif wide and row == RELEASE_SKEW:
            limit = view.protocol.accept.release_skew * row.scale
            line += f"{f'limit ±{limit:g}':>16}"
        lines.append(Content(line))
    for gate in result.gates:
        line = f"{f'at gate {gate.channel}':15}{plus_minus(gate.speed, 1.0):>20} m/s "
        if wide and gate.interval is not None:
            line += f"{plus_minus(gate.interval, 1e3):>16} ms since previous gate"
        lines.append(Content(line))
    counts = " · ".join(f"{kind} {count}" for kind, count in result.audit.json().items())
    lines.append(Content(f"{'edges':15}{counts}"))
    return Content("\n").join(lines)
