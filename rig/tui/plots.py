"""Plots of the screens: figures of the report, and predictions of the next fall."""

from collections.abc import Iterator

from rig.records import Job
from rig.report.falls import fall_figures
from rig.report.figure import Chart, Panel, PlotAxis, Trace
from rig.report.figures import result_figure, runs_figure
from rig.report.looks import MODEL, SECOND
from rig.results.live import SessionView
from rig.tui.motion import ChainFall
from rig.tui.plotting import Picture


def pictures_of(*charts: Chart | None) -> list[Picture]:
    """Return the panels of figures as single pictures; residuals stay below their panel."""
    pictures: list[Picture] = []
    for panel in (panel for chart in charts if chart is not None for panel in chart.panels):
        if panel.y.label.startswith("residual") and pictures:
            pictures[-1] += (panel,)
        else:
            pictures.append((panel,))
    return pictures


def fall_pictures(falls: tuple[ChainFall, ...]) -> list[Picture]:
    """Return z(t) by the model, for a future drop or a drop that does not count."""
    end_s = max((fall.end_s for fall in falls), default=0.0)
    traces = []
    for fall in falls:
        label = f"{fall.role} side" if len(falls) > 1 else "model"
        times, heights = fall.curve(end_s)
        color = SECOND if fall.role == "free" else MODEL
        traces.append(Trace(label, times.tolist(), (100.0 * heights).tolist(), "line", color))
    time = PlotAxis("time since the release fired (s)", limits=(0.0, end_s))
    return [(Panel(time, PlotAxis("z by the model (cm)"), traces),)] * bool(traces)


def drop_pictures(view: SessionView, job: Job) -> list[Picture]:
    """Return the report's figures of a drop; empty if it does not count."""
    timed = view.drops[job], view.scales[job].hz, view.results[job]
    return pictures_of(*fall_figures(view.protocol, timed))


def session_pictures(view: SessionView) -> Iterator[tuple[Picture, str]]:
    """Yield figures of results and of runs in order (for drifts), each with its caption."""
    for chart in (
        result_figure(view.analysis, view.curves),
        runs_figure(view.analysis, view.protocol.accept.release_skew),
    ):
        yield from ((picture, chart.caption) for picture in pictures_of(chart) if chart)
