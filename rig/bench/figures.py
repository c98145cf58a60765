"""Pictures of what the studies found: error against run time, and what scenes cost."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING, Literal

from rig.report.canvas import INK, MODEL, MUTED, PAPER, SECOND, canvas

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

    from rig.bench.precision import Point
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
}
_PRECISION_PANELS = (
    ("separation_error", "relative error of Δz"),
    ("speed_error", "relative error of V"),
    ("gate_error_s", "error of gate time (s)"),
)


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
        modules, commands, work = drawing.axes
        _bars(modules, names, [len(cost.account.rooms) for cost in costs])
        modules.set_ylabel("modules of rig")
        spreads = [cost.seconds["predict"] for cost in costs]
        medians = [1e3 * spread.median for spread in spreads]
        _bars(commands, names, medians, at="center")
        ends = [
            [1e3 * (spread.median - spread.low) for spread in spreads],
            [1e3 * (spread.high - spread.median) for spread in spreads],
        ]
        commands.errorbar(names, medians, yerr=ends, fmt="none", ecolor=INK, elinewidth=0.8)
        commands.set_ylabel("rig predict (ms)")
        _bars(work, names, [cost.account.operations["predict"] for cost in costs])
        work.set_yscale("log")
        work.set_ylabel("bytecodes\nof the prediction")
        work.tick_params(axis="x", labelrotation=40)
        for label in work.get_xticklabels():
            label.set_horizontalalignment("right")
            label.set_rotation_mode("anchor")
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
