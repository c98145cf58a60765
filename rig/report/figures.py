"""Figures of results as SVG text: pure functions of the analysis, byte for byte repeatable."""

from __future__ import annotations

from itertools import groupby, pairwise
from operator import attrgetter
from typing import TYPE_CHECKING, Any

from rig.analysis.result import GOOD
from rig.measurands import GRAVITY, RELEASE_SKEW, SEPARATION, SPEED, acceleration_in, averaged
from rig.report.bars import LABELS, bar
from rig.report.canvas import INK, MODEL, MODEL_BAND, MUTED, RULE, SECOND, annotate, canvas
from rig.report.numbers import fixed, value_of
from rig.report.panels import (
    legend_above,
    limit_lines,
    mark_inclines,
    run_axis,
    run_points,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from matplotlib.axes import Axes

    from rig.analysis.result import DropResult
    from rig.analysis.session import Analysis
    from rig.analysis.summary import Incline
    from rig.measurands import Measurand
    from rig.protocol.protocol import Condition
    from rig.report.bars import Bars

_GAP_DEG = 2.0  # the curve has a point each degree
_DOT: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 3.2, "markeredgewidth": 0}
_MEAN: dict[str, Any] = {
    "fmt": "o",
    "color": INK,
    "markersize": 3.6,
    "elinewidth": 1.2,
    "capsize": 3.5,
    "zorder": 4,
}
_SEGMENTS: dict[str, tuple[Any, str]] = {
    "surface": ("-", "model, rods on the surface"),
    "pile": ((0, (5, 2.5)), "model, rods on a pile (level)"),
}


def incline_figure(
    analysis: Analysis,
    curves: Mapping[str, Any] | None = None,
    simulated: bool = False,
    bars: Bars = "U95",
) -> str:
    """Separation and end speed against inclination (the paper's Fig. 3).

    Parameters
    ----------
    curves
        The model, as `rig.analysis.curves.model_curves` gives it; without, there are no lines.
    simulated
        Whether to stamp the figure.
    bars
        What the bars on means stand for.

    Returns
    -------
    str
        SVG.
    """
    curves = curves or {}
    measured = {name for one in analysis.runs for name in one.quantities}
    rows = [row for row in averaged() if row.name in {*curves, *measured}] or [SEPARATION]
    strips = {row for row in rows if _compared(analysis.summary, row)}
    heights = [height for row in rows for height in ((2.5, 1.2) if row in strips else (3.1,))]
    with canvas(tuple(heights), simulated=simulated) as drawing:
        panels = iter(drawing.axes)
        for row in rows:
            axes = next(panels)
            _incline_panel(axes, analysis, curves, row, bars)
            axes.set_ylabel(row.axis)
            if row == SEPARATION:
                axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
            elif row == SPEED:
                _free_fall_line(axes, value_of(curves.get("free_fall_speed_m_s")))
            if row in strips:
                _residual_strip(next(panels), analysis.summary, row)
        legend_above(drawing.axes[0])
        _incline_axis(drawing.axes[-1])
    return drawing.svg


def _compared(summary: Sequence[Incline], row: Measurand) -> list[Incline]:
    return [line for line in summary if row.name in line.differences]


def _residual_strip(axes: Axes, summary: Sequence[Incline], row: Measurand) -> None:
    """Draw what is measured less what is predicted, with U of that difference."""
    lines = _compared(summary, row)
    differences = [line.differences[row.name] for line in lines]
    left = [row.fine_scale * one.value for one in differences]
    widths = [row.fine_scale * one.expanded for one in differences]
    axes.axhline(0, color=MODEL, linewidth=0.9)
    axes.errorbar([line.incline_deg for line in lines], left, widths, **_MEAN)
    axes.set_ylabel(f"{row.symbol} − model\n({row.fine})")


def runs_figure(
    analysis: Analysis, simulated: bool = False, skew_limit_s: float | None = None
) -> str:
    """Every run in order: separation less its prediction, and below it the release skew.

    The lower panel is left out where no run has a skew. Where there is no prediction, the mean
    of the run's inclination takes its place.

    Parameters
    ----------
    simulated
        Whether to stamp the figure.
    skew_limit_s
        Beyond which a run is void, s; `None` draws no limits.

    Returns
    -------
    str
        SVG.
    """
    runs = sorted(analysis.runs, key=attrgetter("run.number"))
    skewed = any(RELEASE_SKEW.name in one.quantities for one in runs)
    with canvas((3.0, 2.2) if skewed else (3.0,), simulated=simulated) as drawing:
        top, *rest = drawing.axes
        references, words = _references(analysis.summary)
        top.axhline(0, color=MUTED, linewidth=0.9)
        run_points(top, runs, SEPARATION, references)
        top.set_ylabel(f"{SEPARATION.symbol} − {words} ({SEPARATION.unit})")
        for axes in rest:
            axes.axhline(0, color=MUTED, linewidth=0.9)
            run_points(axes, runs, RELEASE_SKEW)
            axes.set_ylabel(f"{RELEASE_SKEW.label} ({RELEASE_SKEW.unit})")
            if skew_limit_s:
                limit_lines(axes, skew_limit_s * RELEASE_SKEW.scale)
        legend_above(top)
        run_axis(drawing.axes[-1])
        mark_inclines(drawing.axes, runs)
    return drawing.svg


def gravity_figure(
    analysis: Analysis, simulated: bool = False, site_m_s2: float | None = None
) -> str:
    """Draw the acceleration of each run, their mean with its uncertainty and the site's value.

    Parameters
    ----------
    analysis
        Of a scene without a surface.
    simulated
        Whether to stamp the figure.
    site_m_s2
        Expected gravity; `None` for what the summary predicts.

    Returns
    -------
    str
        SVG.
    """
    runs = sorted(analysis.runs, key=attrgetter("run.number"))
    row = acceleration_in({name for one in runs for name in one.quantities}) or GRAVITY
    mean = None
    if analysis.summary:
        mean = analysis.summary[0].means.get(row.name)
        if site_m_s2 is None:
            site_m_s2 = value_of(analysis.summary[0].predicted.get(row.name))
    with canvas((3.2,), simulated=simulated) as drawing:
        (axes,) = drawing.axes
        if mean is not None:
            axes.axhspan(
                mean.value - mean.expanded,
                mean.value + mean.expanded,
                color=MODEL_BAND,
                alpha=0.7,
                linewidth=0,
                label="mean ± U (95 %)",
            )
            axes.axhline(mean.value, color=MODEL, label="mean of runs")
        if site_m_s2 is not None:
            expected = "site" if row is GRAVITY else "without friction"
            axes.axhline(
                site_m_s2,
                color=SECOND,
                linestyle=(0, (5, 2.5)),
                label=f"{expected}, {fixed(site_m_s2, row.decimals)} {row.unit}",
            )
        run_points(axes, runs, row)
        axes.set_ylabel(row.axis)
        axes.ticklabel_format(axis="y", useOffset=False)
        legend_above(axes)
        run_axis(axes)
    return drawing.svg


def _incline_panel(
    axes: Axes,
    analysis: Analysis,
    curves: Mapping[str, Any],
    row: Measurand,
    bars: Bars,
) -> None:
    key, scale = row.name, row.scale
    first = None
    for name, part in _segments(curves) if key in curves else ():
        where, _, chain = name.partition(", ")  # unlike chains have curves of their own
        style, label = _SEGMENTS.get(where, (":", f"model, {where}"))
        label = f"{label}, {chain}" if chain else label
        first = chain if first is None else first
        color = MODEL if chain == first else SECOND
        inclines = [curves["incline_deg"][index] for index in part]
        values = [_scaled(curves[key][index], scale) for index in part]
        axes.plot(inclines, values, linestyle=style, color=color, label=label, zorder=3)
        band = curves.get(row.key("U95"))
        if band is not None:
            widths = [_scaled(band[index], scale) for index in part]
            low = [value - width for value, width in zip(values, widths, strict=True)]
            high = [value + width for value, width in zip(values, widths, strict=True)]
            axes.fill_between(inclines, low, high, color=MODEL_BAND, alpha=0.6, linewidth=0)
    for number, gap in enumerate(unanswered(curves) if key in curves else ()):
        axes.axvspan(*gap, facecolor="none", edgecolor=RULE, hatch="////", linewidth=0,
                     label="model has no answer" if number == 0 else None, zorder=0)  # fmt: skip
    dots = list(_single_runs(analysis.runs, key))
    if dots:
        xs, ys = zip(*dots, strict=True)
        axes.plot(xs, [y * scale for y in ys], color=MUTED, alpha=0.45, label="single runs", **_DOT)
    lines = [line for line in analysis.summary if key in line.means]
    if lines:
        axes.errorbar(
            [line.incline_deg for line in lines],
            [line.means[key].value * scale for line in lines],
            yerr=[(bar(line, key, bars) or 0.0) * scale for line in lines],
            label=f"mean of runs ± {LABELS[bars]}",
            **_MEAN,
        )


def unanswered(curves: Mapping[str, Any]) -> list[tuple[float, float]]:
    """Inclines between those of the model's curves for which it has no answer, degrees."""
    found = sorted(set(curves.get("incline_deg", ())))
    return [(low, high) for low, high in pairwise(found) if high - low > _GAP_DEG]


def _segments(curves: Mapping[str, Any]) -> Iterator[tuple[str, list[int]]]:
    """Yield stretches of neighbouring points on the same part of the model."""
    names = curves.get("segments") or ["surface"] * len(curves.get("incline_deg", ()))
    for name, indices in groupby(range(len(names)), key=lambda index: names[index]):
        yield str(name), list(indices)


def _single_runs(runs: Sequence[DropResult], name: str) -> Iterator[tuple[float, float]]:
    """Yield runs that count, spread a little sideways so that they do not hide each other."""
    counted = [one for one in runs if one.verdict in GOOD and name in one.quantities]
    counted.sort(key=attrgetter("run.incline_deg", "run.number"))
    for incline, group in groupby(counted, key=attrgetter("run.incline_deg")):
        members = list(group)
        step = min(0.28, 2.2 / len(members))
        for place, one in enumerate(members):
            yield incline + step * (place - (len(members) - 1) / 2), one.quantities[name].value


def _incline_axis(axes: Axes) -> None:
    axes.set_xlabel("incline of the surface (°)")
    axes.margins(x=0.03)
    low, high = axes.get_xlim()
    if high - low < 10:  # one inclination alone must not fill the axis with thousandths
        axes.set_xlim(low - 5, high + 5)


def _free_fall_line(axes: Axes, speed: float | None) -> None:
    if speed is None:
        return
    axes.axhline(speed, color=MUTED, linewidth=1.0, linestyle=(0, (1, 2)))
    at, coords = (0.005, speed), ("axes fraction", "data")
    annotate(axes, f"free fall, {fixed(speed, 2)} m/s", at, (0, 3), xycoords=coords, color=MUTED)


def _references(summary: Sequence[Incline]) -> tuple[dict[Condition, float], str]:
    """Return what runs are compared with, by condition, and the words for it."""
    model = {line.condition: line.predicted.get(SEPARATION.name) for line in summary}
    found = {key: one.value for key, one in model.items() if one is not None}
    if found:
        return found, "model"
    means = {line.condition: line.means.get(SEPARATION.name) for line in summary}
    return {key: one.value for key, one in means.items() if one is not None}, "mean"


def _scaled(quantity: object, scale: float) -> float:
    value = value_of(quantity)
    return float("nan") if value is None else value * scale
