"""Figures of results as SVG text: pure functions of the analysis, byte for byte repeatable."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING, Any

from rig.measurands import MEASURANDS, averaged
from rig.report.bars import LABELS, bar
from rig.report.canvas import INK, MODEL, MODEL_BAND, MUTED, PAPER, SECOND, canvas
from rig.report.numbers import expanded, fixed, nested, value_of
from rig.report.panels import (
    COUNTED,
    legend_above,
    limit_lines,
    mark_inclines,
    run_axis,
    run_points,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from matplotlib.axes import Axes

    from rig.measurands import Measurand
    from rig.report.bars import Bars

_DOT: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 3.2, "markeredgewidth": 0}
_MEAN: dict[str, Any] = {
    "fmt": "o",
    "color": INK,
    "markersize": 5.0,
    "elinewidth": 1.2,
    "markeredgecolor": PAPER,
    "markeredgewidth": 0.7,
    "zorder": 4,
}
_SEGMENTS: dict[str, tuple[Any, str]] = {
    "surface": ("-", "model, rods on the surface"),
    "pile": ((0, (5, 2.5)), "model, rods on a pile (level)"),
}


def incline_figure(
    analysis: Mapping[str, Any],
    curves: Mapping[str, Any] | None = None,
    simulated: bool = False,
    bars: Bars = "U95",
) -> str:
    """Separation and end speed against inclination (the paper's Fig. 3).

    Parameters
    ----------
    analysis
        What ``rig analyze --json`` prints.
    curves
        The model: lists of one length ``incline_deg``, ``separation_m``, ``speed_m_s`` and
        ``segments``, the last naming the part each point is on (``surface``, ``pile`` or any
        other words; of unlike chains ``surface, chain A``). ``separation_U95_m`` and
        ``speed_U95_m_s`` add bands, a single number ``free_fall_speed_m_s`` adds that line.
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
    measured = [*(analysis.get("summary") or ()), *(analysis.get("runs") or ())]
    panels = [
        row
        for row in averaged()
        if row.name in curves or any(value_of(line.get(row.name)) is not None for line in measured)
    ] or [MEASURANDS["separation_m"]]
    with canvas((3.1,) * len(panels), simulated=simulated) as drawing:
        for axes, row in zip(drawing.axes, panels, strict=True):
            _incline_panel(axes, analysis, curves, row, bars)
            axes.set_ylabel(row.axis)
            if row.name == "separation_m":
                axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
            elif row.name == "speed_m_s":
                _free_fall_line(axes, value_of(curves.get("free_fall_speed_m_s")))
        # The empty corner: both quantities fall towards steep surfaces, but for a chain whose α is
        # given beside one whose α is not.
        if drawing.axes[0].get_legend_handles_labels()[0]:
            several = any(", " in str(name) for name in curves.get("segments") or ())
            drawing.axes[0].legend(loc="best" if several else "upper right")
        _incline_axis(drawing.axes[-1])
    return drawing.svg


def runs_figure(
    analysis: Mapping[str, Any], simulated: bool = False, skew_limit_s: float | None = None
) -> str:
    """Every run in order: separation less its prediction, and below it the release skew.

    The lower panel is left out where no run has a skew. Where there is no prediction, the mean
    of the run's inclination takes its place.

    Parameters
    ----------
    analysis
        What ``rig analyze --json`` prints.
    simulated
        Whether to stamp the figure.
    skew_limit_s
        Beyond which a run is void, s; `None` draws no limits.

    Returns
    -------
    str
        SVG.
    """
    runs = sorted(analysis.get("runs") or (), key=lambda run: run["run"])
    skewed = any(value_of(run.get("release_skew_s")) is not None for run in runs)
    with canvas((3.0, 2.2) if skewed else (3.0,), simulated=simulated) as drawing:
        top, *rest = drawing.axes
        references, words = _references(analysis.get("summary") or ())
        top.axhline(0, color=MUTED, linewidth=0.9)
        run_points(top, runs, "separation_m", 100.0, references)
        top.set_ylabel(f"Δz − {words} (cm)")
        for axes in rest:
            axes.axhline(0, color=MUTED, linewidth=0.9)
            run_points(axes, runs, "release_skew_s", 1000.0)
            axes.set_ylabel("release skew (ms)")
            if skew_limit_s:
                limit_lines(axes, skew_limit_s * 1000)
        legend_above(top)
        run_axis(drawing.axes[-1])
        mark_inclines(drawing.axes, runs)
    return drawing.svg


def gravity_figure(
    analysis: Mapping[str, Any], simulated: bool = False, site_m_s2: object = None
) -> str:
    """Draw the acceleration of each run, their mean with its uncertainty and the site's value.

    Parameters
    ----------
    analysis
        What ``rig analyze --json`` prints for a scene without a surface.
    simulated
        Whether to stamp the figure.
    site_m_s2
        Expected gravity: a number, a quantity object, or `None` for what the summary predicts.

    Returns
    -------
    str
        SVG.
    """
    runs = sorted(analysis.get("runs") or (), key=lambda run: run["run"])
    summary: Mapping[str, Any] = next(iter(analysis.get("summary") or ()), {})
    if site_m_s2 is None:
        site_m_s2 = nested(summary, "predicted", "gravity_m_s2")
    with canvas((3.2,), simulated=simulated) as drawing:
        (axes,) = drawing.axes
        mean, uncertainty = (
            value_of(summary.get("gravity_m_s2")),
            expanded(summary.get("gravity_m_s2")),
        )
        if mean is not None:
            if uncertainty is not None:
                axes.axhspan(
                    mean - uncertainty,
                    mean + uncertainty,
                    color=MODEL_BAND,
                    alpha=0.7,
                    linewidth=0,
                    label="mean ± U (95 %)",
                )
            axes.axhline(mean, color=MODEL, label="mean of runs")
        site = value_of(site_m_s2)
        if site is not None:
            axes.axhline(
                site,
                color=SECOND,
                linestyle=(0, (5, 2.5)),
                label=f"site, {fixed(site, 4)} m/s²",
            )
        run_points(axes, runs, "gravity_m_s2", 1.0)
        axes.set_ylabel(MEASURANDS["gravity_m_s2"].axis)
        axes.ticklabel_format(axis="y", useOffset=False)
        legend_above(axes)
        run_axis(axes)
    return drawing.svg


def _incline_panel(
    axes: Axes,
    analysis: Mapping[str, Any],
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
    dots = list(_single_runs(analysis.get("runs") or (), key))
    if dots:
        xs, ys = zip(*dots, strict=True)
        axes.plot(xs, [y * scale for y in ys], color=MUTED, alpha=0.45, label="single runs", **_DOT)
    lines = [line for line in analysis.get("summary") or () if value_of(line.get(key)) is not None]
    if lines:
        axes.errorbar(
            [line["incline_deg"] for line in lines],
            [_scaled(line[key], scale) for line in lines],
            yerr=[(bar(line, key, bars) or 0.0) * scale for line in lines],
            label=f"mean of runs ± {LABELS[bars]}",
            **_MEAN,
        )


def _segments(curves: Mapping[str, Any]) -> Iterator[tuple[str, list[int]]]:
    """Yield stretches of neighbouring points on the same part of the model."""
    names = curves.get("segments") or ["surface"] * len(curves.get("incline_deg", ()))
    for name, indices in groupby(range(len(names)), key=lambda index: names[index]):
        yield str(name), list(indices)


def _single_runs(runs: Sequence[Mapping[str, Any]], key: str) -> Iterator[tuple[float, float]]:
    """Yield runs that count, spread a little sideways so that they do not hide each other."""
    counted = [
        run for run in runs if run.get("verdict") in COUNTED and value_of(run.get(key)) is not None
    ]
    counted.sort(key=lambda run: (run["incline_deg"], run["run"]))
    for incline, group in groupby(counted, key=lambda run: float(run["incline_deg"])):
        members = list(group)
        step = min(0.28, 2.2 / len(members))
        for place, run in enumerate(members):
            yield incline + step * (place - (len(members) - 1) / 2), value_of(run[key]) or 0.0


def _incline_axis(axes: Axes) -> None:
    axes.set_xlabel("inclination of the surface (°)")
    axes.margins(x=0.03)
    low, high = axes.get_xlim()
    if high - low < 10:  # one inclination alone must not fill the axis with thousandths
        axes.set_xlim(low - 5, high + 5)


def _free_fall_line(axes: Axes, speed: float | None) -> None:
    if speed is None:
        return
    axes.axhline(speed, color=MUTED, linewidth=1.0, linestyle=(0, (1, 2)))
    axes.annotate(
        f"free fall, {fixed(speed, 2)} m/s",
        (0.005, speed),
        xycoords=("axes fraction", "data"),
        xytext=(0, 3),
        textcoords="offset points",
        color=MUTED,
        fontsize=8,
    )


def _references(
    summary: Sequence[Mapping[str, Any]],
) -> tuple[dict[tuple[float, str | None], float], str]:
    """Return what runs are compared with, by incline and unlike chain, and the words for it."""

    def case(line: Mapping[str, Any]) -> tuple[float, str | None]:
        return float(line["incline_deg"]), line.get("impact_chain")

    predicted = {
        case(line): value_of(nested(line, "predicted", "separation_m")) for line in summary
    }
    words = "model" if any(value is not None for value in predicted.values()) else "mean"
    if words == "mean":
        predicted = {case(line): value_of(line.get("separation_m")) for line in summary}
    return {key: value for key, value in predicted.items() if value is not None}, words


def _scaled(quantity: object, scale: float) -> float:
    value = value_of(quantity)
    return float("nan") if value is None else value * scale
