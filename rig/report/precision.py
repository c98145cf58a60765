"""Error against run time, log–log: one line a method, one picture a scene."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING

from rig.report.canvas import INK, MODEL, MUTED, SECOND, canvas

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

    from rig.bench.precision import Point

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
_PANELS = (
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

    Raises
    ------
    InputError
        If matplotlib is not installed.
    """
    with canvas((4.9, 2.9, 2.9), 8.0, simulated=False) as drawing:
        for panel, (field, label) in zip(drawing.axes, _PANELS, strict=True):
            for _, line in groupby(points, key=lambda point: point.method):
                _draw(panel, field, list(line))
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


def _draw(panel: Axes, field: str, line: Sequence[Point]) -> None:
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
