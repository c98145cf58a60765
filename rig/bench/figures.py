"""Pictures of what the studies found: error against run time, and what scenes cost."""

from __future__ import annotations

from itertools import cycle, groupby
from operator import itemgetter
from statistics import fmean
from typing import TYPE_CHECKING, Any, Literal

from rig.analysis.result import GOOD
from rig.measurands import RELEASE_SKEW, SEPARATION, SPEED
from rig.report.canvas import INK, MODEL, MUTED, PAPER, SECOND, canvas

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.axes import Axes

    from rig.bench.precision import Point
    from rig.bench.resolved import JudgedDrop
    from rig.bench.scenes import Cost

FLOOR = 1e-17
"""Where an error of 0 is drawn."""
_CEILING = 3.0

_COLORS = {"discrete": MODEL, "continuum": SECOND, "contact": INK}
_MARKERS = {
    "RK45": "o",
    "DOP853": "s",
    "Radau": "^",
    "BDF": "v",
    "LSODA": "D",
    "Euler": "x",
    "RK4": "+",
    "Gauss–Legendre": ">",
    "tanh–sinh": "<",
    "motion": "P",
}
_PRECISION_PANELS = (
    ("separation_error", "relative error of Δz"),
    ("speed_error", "relative error of V"),
    ("gate_error_s", "error of gate time (s)"),
)
_ESTIMATOR_PANELS = (("separation_rms_m", 1e3, "rms error of Δz (mm)"),
           ("speed_rms_m_s", 1e3, "rms error of V (mm/s)"))  # fmt: skip
_ROW_IN = 0.17
_LONGEST_LABEL = 24
"""Characters; more gates than that are only counted."""
_VOID_DARKEST = 0.2
"""Share of void drops from which on a layout is drawn as dark as can be."""
_SHADES = "Oranges"
_WORLD_ERROR_MM = 0.1
"""Of Δz, that the resolved world may make before its falls are chaotic."""
_STYLES = (("o", MUTED), ("s", INK), ("D", MODEL), ("*", SECOND), ("^", MUTED), ("v", INK))


def precision_figure(title: str, points: Sequence[Point]) -> str:
    """Draw a scene's work–precision picture.

    Parameters
    ----------
    title
        Of the scene.
    points
        Of this scene only, in the order of the sweep.

    Returns
    -------
    str
        SVG.
    """
    with canvas((4.9, 2.9, 2.9), 8.0, simulated=False) as drawing:
        for panel, (field, label) in zip(drawing.axes, _PRECISION_PANELS, strict=True):
            for _, line in groupby(points, key=lambda point: point.method):
                _draw_method(panel, field, list(line))
            panel.set_xscale("log")
            panel.set_yscale("log")
            panel.set_ylim(FLOOR / 3.0, _CEILING)
            panel.axhline(FLOOR, color=MUTED, linewidth=0.6, linestyle=":")
            panel.set_ylabel(label)
        drawing.axes[-1].set_xlabel(
            "median run time (s), with quartiles; dotted: no float is nearer"
        )
        handles, labels = drawing.axes[1].get_legend_handles_labels()
        drawing.figure.legend(
            handles,
            labels,
            title=f"{title}: each method against 50 digits of its own model",
            title_fontsize=9.5,
            alignment="left",
            loc="outside upper center",
            ncols=4,
            fontsize=7.0,
        )
    return drawing.svg


def _draw_method(panel: Axes, field: str, line: Sequence[Point]) -> None:
    """Draw one method; colours stand for models, marks for solvers."""
    drawn = [(point, getattr(point, field)) for point in line]
    drawn = [(point, error) for point, error in drawn if error is not None]
    if not drawn:
        return
    first = line[0]
    kind = first.method.split()[-1]
    fixed = first.method.startswith("fixed-step")
    color = MUTED if fixed else _COLORS[first.model]
    times = [point.median_s for point, _ in drawn]
    bars = [
        [point.median_s - point.lower_s for point, _ in drawn],
        [point.upper_s - point.median_s for point, _ in drawn],
    ]
    panel.errorbar(
        times,
        [min(max(error, FLOOR), _CEILING) for _, error in drawn],
        xerr=bars,
        label=first.method,
        color=color,
        marker=_MARKERS.get(kind, "*"),
        markersize=8 if kind not in _MARKERS else 4.5,
        # Contact times make another model each: no curve of work against precision joins them.
        linestyle="none" if first.model == "contact" else "-",
        linewidth=0.9,
        elinewidth=0.6,
        capsize=0,
        markerfacecolor="none" if first.model == "contact" else color,
    )


def estimators_figure(found: Sequence[Mapping[str, Any]]) -> str:
    """Draw them; what takes no processor time is a line across.

    Parameters
    ----------
    found
        ``estimators`` of ``rig bench estimators --json``.

    Returns
    -------
    str
        SVG.
    """
    with canvas((3.2, 3.0), simulated=True) as drawing:
        for axes, (field, scale, label) in zip(drawing.axes, _ESTIMATOR_PANELS, strict=True):
            styles = iter(_STYLES)
            for name, group in groupby(found, key=itemgetter("name")):
                points = list(group)
                values = [one[field] * scale for one in points]
                if points[0]["seconds"] is None:
                    axes.axhline(values[0], color=MUTED, linestyle=(0, (1, 2)), label=name)
                    continue
                marker, color = next(styles)
                times = [one["seconds"] or 0.0 for one in points]
                words = f"{name} (M = 10² …)" if points[0]["trials"] else name
                axes.plot(times, values, marker=marker, color=color, linewidth=0.9, label=words)
            axes.set_xscale("log")
            axes.set_yscale("log")
            axes.set_ylabel(label)
        drawing.axes[-1].set_xlabel("processor time per run (s)")
        drawing.axes[0].legend(ncols=2)
    return drawing.svg


def scenes_figure(costs: Sequence[Cost]) -> str:
    """Draw the costs of scenes as bars.

    Parameters
    ----------
    costs
        In the order in which they are drawn.

    Returns
    -------
    str
        SVG.
    """
    names = [cost.scene for cost in costs]
    with canvas((1.5, 1.5, 1.9), simulated=False) as drawing:
        modules, whole, work = drawing.axes
        _bars(modules, names, [len(cost.account.rooms) for cost in costs])
        modules.set_ylabel("modules of rig")
        spreads = [cost.seconds["predict"] for cost in costs]
        medians = [1e3 * spread.median for spread in spreads]
        _bars(whole, names, medians, at="center")
        ends = [
            [1e3 * (spread.median - spread.low) for spread in spreads],
            [1e3 * (spread.high - spread.median) for spread in spreads],
        ]
        whole.errorbar(names, medians, yerr=ends, fmt="none", ecolor=INK, elinewidth=0.8)
        whole.set_ylabel("rig predict (ms)")
        _bars(work, names, [cost.account.operations["predict"] for cost in costs])
        work.set_yscale("log")
        work.set_ylabel("bytecodes\nof the prediction")
        work.tick_params(axis="x", labelrotation=40)
        for label in work.get_xticklabels():
            label.set_horizontalalignment("right")
            label.set_rotation_mode("anchor")
    return drawing.svg


def layouts_figure(found: Sequence[Mapping[str, Any]]) -> str:
    """Draw the map of layouts: a row each, a column a disturbance, void and wrong side by side.

    Parameters
    ----------
    found
        ``layouts`` of ``rig bench layouts --json``.

    Returns
    -------
    str
        SVG.
    """
    columns = list(dict.fromkeys(one["disturbance"] for one in found))
    rows = list(dict.fromkeys((one["chain"], one["gates"], one["heights_mm"]) for one in found))
    # Whether wrong rods were accepted is a matter of some or none.
    panels = (
        ("void drops", "void_share", _VOID_DARKEST),
        ("good drops with a wrong rod", "wrong", 1.0),
    )
    with canvas(
        (_ROW_IN * len(rows) + 0.6,), 8.0, simulated=True, columns=2, sharex=False
    ) as drawing:
        for axes, (title, field, darkest) in zip(drawing.axes, panels, strict=True):
            values = [one[field] for one in found]
            table = [values[n : n + len(columns)] for n in range(0, len(values), len(columns))]
            axes.imshow(table, cmap=_SHADES, vmin=0.0, vmax=darkest, aspect="auto")
            for row, line in enumerate(table):
                for column, value in enumerate(line):
                    text = f"{value:.0%}" if field == "void_share" else f"{value:d}"
                    color = PAPER if value > 0.6 * darkest else INK if value else MUTED
                    axes.text(
                        column, row, text, ha="center", va="center", fontsize=6.5, color=color
                    )
            axes.set_xticks(range(len(columns)), columns)
            axes.set_yticks([])
            axes.set_title(title, fontsize=9.0)
            axes.grid(visible=False)
        labels = [
            f"{chain}: {heights if len(heights) <= _LONGEST_LABEL else gates}"
            for chain, gates, heights in rows
        ]
        drawing.axes[0].set_yticks(range(len(rows)), labels, fontsize=6.5)
    return drawing.svg


def resolved_figure(drops: Sequence[JudgedDrop]) -> str:
    """Draw the errors of resolved sessions against inclination: Δz, V and skew below each other.

    Parameters
    ----------
    drops
        Of the study; those that were void have no errors, and are counted at the foot.

    Returns
    -------
    str
        SVG.
    """
    rows = [SEPARATION, SPEED, RELEASE_SKEW]
    cases = list(dict.fromkeys(one.case for one in drops))
    with canvas((2.7, 2.3, 2.3, 1.6), 8.0, simulated=True) as drawing:
        *panels, foot = drawing.axes
        for number, (case, (marker, color)) in enumerate(
            zip(cases, cycle((*_STYLES, ("x", SECOND), ("+", INK), ("P", MODEL))), strict=False)
        ):
            mine = [one for one in drops if one.case == case]
            aside = 0.55 * (number - (len(cases) - 1) / 2)
            for panel, row in zip(panels, rows, strict=True):
                read = [one for one in mine if row.name in one.errors]
                panel.errorbar(
                    [one.incline_deg + aside for one in read],
                    [row.fine_scale * one.errors[row.name][0] for one in read],
                    [row.fine_scale * one.errors[row.name][1] for one in read],
                    color=color, marker=marker, linestyle="none", markersize=3.0, elinewidth=0.5,
                    capsize=0, label=case,
                )  # fmt: skip
            inclines = sorted({one.incline_deg for one in mine})
            shares = [
                fmean(one.verdict not in GOOD for one in mine if one.incline_deg == incline)
                for incline in inclines
            ]
            foot.plot(
                [incline + aside for incline in inclines], [100 * share for share in shares],
                color=color, marker=marker, linestyle="none", markersize=4.0,
            )  # fmt: skip
        for panel, row in zip(panels, rows, strict=True):
            panel.axhline(0.0, color=MUTED, linewidth=0.9)
            panel.set_ylabel(f"error of {row.symbol} ({row.fine})")
        foot.set_ylabel("void drops (%)")
        foot.set_xlabel("inclination of the surface (°); bars are U95, cases side by side")
        handles, labels = panels[0].get_legend_handles_labels()
        drawing.figure.legend(handles, labels, loc="outside upper center", ncols=5, fontsize=7.0)
    return drawing.svg


def work_figure(lines: Sequence[Mapping[str, Any]]) -> str:
    """Draw error against run time of the resolved world.

    Parameters
    ----------
    lines
        As `rig.bench.resolved.work` gives them.

    Returns
    -------
    str
        SVG.
    """
    kinds = (
        ("step", "leapfrog, by its step (µs)", "o", MODEL, "step_s", 1e6),
        ("Euler", "semi-implicit Euler", "v", MUTED, "step_s", 1e6),
        ("Runge and Kutta", "Runge and Kutta", "^", INK, "step_s", 1e6),
        ("touch", "length of touches (ms); step in proportion", "s", SECOND, "touch_s", 1e3),
    )
    with canvas((3.6,), simulated=False) as drawing:
        (panel,) = drawing.axes
        for kind, label, marker, color, field, scale in kinds:
            some = [one for one in lines if one["changed"] == kind and one["rms_m"]]
            times, errors = [one["cpu_s"] for one in some], [1e3 * one["rms_m"] for one in some]
            panel.plot(times, errors, color=color, marker=marker, markersize=4.5, label=label)
            for time, error, one in zip(times, errors, some, strict=True):
                panel.annotate(f" {scale * one[field]:g}", (time, error), fontsize=8, color=color)
        panel.axhline(_WORLD_ERROR_MM, color=MUTED, linestyle=":", linewidth=1.2)
        panel.set_xscale("log")
        panel.set_yscale("log")
        panel.set_xlabel("processor time of a fall of three rods (s)")
        panel.set_ylabel("rms error of Δz at the strike (mm)")
        panel.legend(loc="best")
    return drawing.svg


def _bars(
    panel: Axes,
    names: Sequence[str],
    values: Sequence[float],
    at: Literal["edge", "center"] = "edge",
) -> None:
    bars = panel.bar(names, values, color=MODEL, width=0.7)
    color = INK if at == "edge" else PAPER
    panel.bar_label(bars, fmt="{:.0f}", label_type=at, fontsize=6.5, padding=2, color=color)
    panel.margins(y=0.15)
