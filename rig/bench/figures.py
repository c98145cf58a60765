"""Pictures of what the studies found."""

from __future__ import annotations

from contextlib import contextmanager
from itertools import groupby
from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure

from rig.report import looks
from rig.report.plot import drawing_file, style

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from rig.bench.stability import StabilityRow
    from rig.bench.work import Point

INK, MODEL, SECOND, MUTED = (
    looks.COLORS[number][0] for number in (looks.INK, looks.MODEL, looks.SECOND, looks.MUTED)
)
FLOOR = 3e-17
"""Where an error of 0 is drawn: no float is nearer."""
_CEILING = 1.0
_THIN = {"markersize": 5, "linewidth": 0.9, "elinewidth": 0.6}
_LOOKS: list[dict[str, Any]] = [
    {"marker": marker, "color": color, **line, **_THIN}
    for line in ({"linestyle": "-"}, {"linestyle": "--", "markerfacecolor": "none"})
    for marker, color in zip("Dos^vP", (MODEL, SECOND, INK, MUTED, MODEL, SECOND), strict=True)
]


@contextmanager
def canvas(*heights: float) -> Iterator[Figure]:
    """Set the style up, and hand out empty panels of so many inches above each other."""
    with style():
        drawing = Figure(figsize=(7.0, sum(heights)), layout="constrained")
        drawing.subplots(len(heights), sharex=True, height_ratios=heights)
        yield drawing


def work_figure(title: str, points: Sequence[Point]) -> str:
    """Draw a problem's work–precision picture, a line a method; return SVG."""
    lines = {method: list(line) for method, line in groupby(points, lambda point: point.method)}
    return _picture(f"{title}: relative error against processor time", lines, 4)


def choice_figure(lines: Mapping[str, Sequence[Point]]) -> str:
    """Draw the method to choose for each problem, at most six problems; return SVG.

    Parameters
    ----------
    lines
        All settings of that method, by the problem's title. Of problems that differ by one number
        alone, the last is drawn.
    """
    kinds = {points[0].problem.partition("-")[0]: title for title, points in lines.items()}
    named = {f"{title}: {lines[title][0].method}": lines[title] for title in kinds.values()}
    return _picture("What to choose", dict([*named.items()][:6]), 1)


def _picture(title: str, lines: Mapping[str, Sequence[Point]], columns: int) -> str:
    with canvas(4.4) as drawing:
        (panel,) = drawing.axes
        for (label, points), look in zip(lines.items(), _LOOKS, strict=False):
            times = [point.cpu_s for point in points]
            errors = [min(max(point.error, FLOOR), _CEILING) for point in points]
            below = [point.cpu_s - point.lower_s for point in points]
            above = [point.upper_s - point.cpu_s for point in points]
            panel.errorbar(times, errors, xerr=[below, above], label=label, **look)
        panel.set(xscale="log", yscale="log", ylim=(FLOOR / 2.0, _CEILING))
        panel.set_xlabel("processor time of one solution (s): median, quartiles")
        panel.set_ylabel("relative error")
        drawing.legend(
            title=title, alignment="left", loc="outside upper center", ncols=columns, fontsize=7.5
        )
    return drawing_file(drawing, "svg").decode()


def conditioning_figure(rows: Sequence[StabilityRow]) -> str:
    """Draw errors against what the inputs' own rounding explains; return SVG."""
    with canvas(4.4) as drawing:
        (panel,) = drawing.axes
        for label, field, color, marker in (
            ("the equations computed as printed", "naive_error", MUTED, "x"),
            ("this program", "error", MODEL, "o"),
        ):
            numbers = [row for row in rows if getattr(row, field) is not None]
            expected = [min(row.expected, 5.0) for row in numbers]
            errors = [min(max(getattr(row, field), FLOOR), 10.0) for row in numbers]
            panel.plot(expected, errors, marker, color=color, markersize=3.5, label=label)
        panel.axline((1e-16, 1e-16), (1.0, 1.0), color=INK, linewidth=0.8, label="error = κ·ε")
        panel.set(xscale="log", xlim=(1e-16, 10.0), yscale="log", ylim=(FLOOR / 2.0, 20.0))
        panel.set_xlabel("κ·ε: what rounding of the inputs alone may cost")
        panel.set_ylabel("relative error against 50 digits")
        panel.legend(loc="best")
    return drawing_file(drawing, "svg").decode()


def scenes_figure(names: Sequence[str], panels: Mapping[str, Sequence[float]]) -> str:
    """Draw what scenes cost beside the whole, a panel a kind of cost; return SVG."""
    with canvas(*[1.25] * (len(panels) - 1), 1.75) as drawing:
        for panel, (label, shares) in zip(drawing.axes, panels.items(), strict=True):
            bars = panel.bar(names, shares, color=MODEL)
            panel.bar_label(bars, fmt="{:.2g}", fontsize=6.5)
            panel.margins(y=0.2)
            panel.set_ylabel(label)
            panel.set_xticks(range(len(names)), names, rotation=40, ha="right")
    return drawing_file(drawing, "svg").decode()
