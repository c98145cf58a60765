"""What the plots show: the report's own figures, and a fall that is not over yet."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

from rig.report.falls import fall_figures
from rig.report.figure import Chart, Panel, PlotAxis, measured, series
from rig.report.figures import result_figure, runs_figure
from rig.report.looks import MODEL, MUTED, SECOND
from rig.tui.plotting import Picture, Series

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from rig.analysis.session import Analysis
    from rig.records import Job
    from rig.report.figure import Trace
    from rig.results.live import SessionView
    from rig.tui.motion import ChainFall

    Kind = Literal["line", "band", "dots", "bars"]

_KINDS: Mapping[str, tuple[Kind, str]] = {
    "line": ("line", ""), "dash": ("line", ""), "thick": ("line", ""), "level": ("line", ""),
    "limit": ("line", ""), "shade": ("line", ""), "band": ("band", ""), "points": ("dots", "+"),
    "mean": ("bars", "●"),
    "ring": ("bars", "○"), "square": ("bars", "●"), "cross": ("dots", "×"),
}  # fmt: skip
"""How the report's roles are drawn in dots: of a shade its edges; gaps are not."""
_COLORS = {MODEL: "accent", SECOND: "secondary", MUTED: "foreground"}
_GRAVITY = (
    "g: gravity from each free fall; if the bars miss the protocol's value, check heights and clock"
)
_BEFORE_S = 0.02
_MOST = 300  # marks of a chain: more would stand on each other


def pictures_of(*charts: Chart | None) -> list[Picture]:
    """Take panels of figures as pictures; what is left over stands in a strip below."""
    pictures: list[Picture] = []
    for panel in (panel for chart in charts if chart is not None for panel in chart.panels):
        lows_highs = _ends(panel)
        drawn = tuple(_drawn(trace, lows_highs) for trace in panel.series if trace.role in _KINDS)
        label = panel.y.label.replace("\n", " ")
        if label.startswith("residual") and pictures:
            pictures[-1] = pictures[-1]._replace(residuals=drawn, residual_label=label)
        else:
            counts = panel.x.whole
            pictures.append(Picture(label, panel.x.label, drawn, lows_highs, counts))
    return pictures


def _ends(panel: Panel) -> tuple[float, float]:
    room = 0.5 if panel.x.whole else 0.0
    places = [place for trace in panel.series for place in trace.x] or [0.0]
    return min(places) - room, max(places) + room


def _drawn(trace: Trace, ends: tuple[float, float]) -> Series:
    kind, marker = _KINDS[trace.role]
    color = "error" if trace.role == "cross" else _COLORS.get(trace.color, "primary")
    x, y = trace.x, trace.y
    if trace.role in {"level", "limit", "shade"}:  # from end to end, a line for each
        x = [place for _ in trace.y for place in (*ends, float("nan"))]
        y = [level for level in trace.y for _ in range(3)]
    color = "border" if trace.role in {"band", "shade"} else color
    return Series(kind, x, y, color, marker, trace.label, trace.u)


def fall_pictures(falls: tuple[ChainFall, ...]) -> list[Picture]:
    """Draw z(t) of what falls, as far as it has fallen, with the model's curves."""
    if not falls:
        return []
    end = max(fall.end_s for fall in falls) + _BEFORE_S
    lines, dots, residuals = [], [], []
    for fall in falls:
        side = f", {fall.role} side" * (len(falls) > 1)
        color, mark = ("secondary", "+") if fall.role == "free" else ("primary", "×")
        times, heights = fall.curve(end)
        lines.append(Series("line", times * 1e3, heights * 1e2, "accent", label=f"model{side}"))
        thin = slice(None, None, 1 + fall.times.size // _MOST)
        times, heights = fall.times[thin] * 1e3, fall.heights[thin] * 1e2
        dots.append(Series("dots", times, heights, color, mark, f"measured{side}"))
        if fall.model is not None and times.size:
            off = heights - fall.model.heights(fall.times[thin] - fall.delay_s)[0] * 1e2
            residuals.append(Series("dots", times, 10.0 * off, color, mark))
    return [Picture("z (cm) as it fell", "t (ms)", (*lines, *dots), (0.0, end * 1e3),
                    residuals=tuple(residuals), residual_label="minus model (mm)")]  # fmt: skip


def drop_figures(view: SessionView, job: Job) -> list[Chart]:
    """Return the report's figures of a drop; none where it does not count."""
    drop, hz = view.drops[job], view.scales[job].hz
    return [*fall_figures(view.protocol, drop, hz, view.results[job])]


def inclined(analysis: Analysis, curves: Mapping[str, Any]) -> list[Picture]:
    """Draw the result beside the model: against incline, the paper's Fig. 3, growing.

    Parameters
    ----------
    curves
        The model, as `rig.analysis.curves.model_curves` gives it.
    """
    return pictures_of(result_figure(analysis, curves))


def session_pictures(view: SessionView) -> Iterator[tuple[Picture, str]]:
    """Draw results, and what a drift would show in, each with what it is read for."""
    analysis, gravity = view.analysis, view.protocol.gravity.value
    limit = view.protocol.accept.release_skew
    for chart in (result_figure(analysis, view.curves, site_m_s2=gravity),
                  runs_figure(analysis, limit)):  # fmt: skip
        for picture in pictures_of(chart):
            yield picture, chart.caption if chart else ""
    falls = [(run.run.number, run.gravity) for run in analysis.runs if run.gravity]
    if falls:
        traces = [measured("counts ± U", falls, "mean"),
                  series("protocol", (), (gravity,), "limit", SECOND)]  # fmt: skip
        panel = Panel(PlotAxis("run", whole=True), PlotAxis("g in free fall (m/s²)"), traces)
        yield from ((picture, _GRAVITY) for picture in pictures_of(Chart("", "", [panel])))
