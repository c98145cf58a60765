"""A figure as plain data: what is drawn, and not how.

Whoever draws it (`rig.report.plot` for pages and files) or writes it (`csv_table`) adds nothing
to it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig.analysis.result import Measured
from rig.report import looks
from rig.report.columns import read_tables, value_at
from rig.text_table import csv_text

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

COLUMN_PT, WIDE_PT = 244.0, 400.0
"""A journal's column of 86 mm, which is a telephone's width too, and the width of a page."""
_FIGURES = dict(read_tables(Path(__file__).with_name("figures.txt").read_text("utf-8")))
_FEW = 40  # points that are drawn large
_LINES = {"zero": (0.0,), "unity": (-1.0, 1.0)}
_BARE = ("points", "cross")  # roles without bars
_COLUMNS = ("panel", "x_axis", "y_axis", "series", "x", "y", "U95", "begins")


@dataclass(frozen=True, slots=True)
class Trace:
    """What is drawn in one way.

    Attributes
    ----------
    label
        Written beside it; empty writes nothing.
    x, y
        In units of the axes.
    role
        How it looks. A `line`, `dash` or `thick` line joins its points, with a gap where one is not
        a number; a `band` fills y ± u; a `level` or `limit` is a line across the panel at each y; a
        `shade` fills the panel between two y, a `gap` between two x; `points` are small, `mean`,
        `ring` and `square` large, with bars of u; a `cross` does not set the scale; a `bar` lies
        from `base` to x; `words` are only the label, outwards from the point; a `map` shades the
        grid of x and y by z, in steps at the levels u, and `levels` are numbered lines there.
    u
        Half-widths along y, or along x where `across`.
    base
        Where each bar begins.
    z
        Of a grid, row by row.
    color
        A place in `rig.report.looks.COLORS`.
    """

    label: str
    x: Sequence[float]
    y: Sequence[float]
    role: str
    color: int = 0
    u: Sequence[float] = ()
    base: Sequence[float] = ()
    across: bool = False
    z: Sequence[float] = ()


@dataclass(frozen=True, slots=True)
class PlotAxis:
    """An axis: its label with the unit, names in place of numbers, limits."""

    label: str
    names: Mapping[float, str] = field(default_factory=dict)
    limits: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class Panel:
    """Series on two axes, so many points high; neighbours with equal x axes share one.

    Where the panel is `true`, a unit is as long on both axes.
    """

    x: PlotAxis
    y: PlotAxis
    series: list[Trace]
    height: float = 120.0
    true: bool = False

    @property
    def whole(self) -> bool:
        """Whether nothing lies between whole numbers of x, such as of runs."""
        return all(place.is_integer() for trace in self.series for place in trace.x)


@dataclass(frozen=True, slots=True)
class Chart:
    """Panels above each other.

    Attributes
    ----------
    title
        What is shown, for who hears the page.
    caption
        One line below the figure.
    simulated
        Whether to stamp it.
    foot
        Lines below the panels, for a figure that stands alone.
    width
        As a file, points.
    facts
        For programs, in the file's metadata.
    """

    title: str
    caption: str
    panels: Sequence[Panel]
    simulated: bool = False
    foot: Sequence[str] = ()
    width: float = COLUMN_PT
    facts: str = ""


def chart(name: str, *panels: Mapping[str, Any], **values: object) -> Chart:
    """Draw a figure as ``figures.txt`` describes it.

    Parameters
    ----------
    panels
        All its panels are drawn for each: the records of their series, by name, what their labels
        ask for, and options of both axes.
    values
        What title and caption ask for.
    """
    title, caption, rows, _ = _FIGURES[name]
    drawn = [panel for sources in panels for panel in _panels(rows, {**_LINES, **sources})]
    return Chart(title.format(**values), caption.format(**values), drawn)


def _panels(rows: Iterable[Sequence[str]], sources: Mapping[str, Any]) -> list[Panel]:
    """Draw panels from their rows; without those that only lines cross, but for maps."""
    panels: list[Panel] = []
    scale = 1.0
    for kind, *cells in rows:
        if kind == "panel":
            x, y, height, *factor = (_written(cell, sources) for cell in cells)
            x_axis, y_axis = (sources.get(axis, {}) for axis in ("x_axis", "y_axis"))
            scale = float(*factor or (1.0,))
            traces, true = [*sources.get("traces", ())], sources.get("true", False)
            axes = PlotAxis(x, **x_axis), PlotAxis(y, **y_axis)
            panels.append(Panel(*axes, traces, float(height), true))
        elif kind == "residuals":
            panels += residual_panels(panels[-1].x, _points(cells, sources))
        else:
            panels[-1].series.extend(_traces(kind, cells, sources, scale))
    return [each for each in panels if "traces" in sources or any(line.x for line in each.series)]


def _traces(
    role: str, cells: Sequence[str], sources: Mapping[str, Any], scale: float
) -> Iterator[Trace]:
    """Draw records as one series, or each group of records as a series of its own."""
    paint, label, source, *places = cells
    name, grouped, key = source.partition("*")
    for group in sources.get(name, ()) if grouped else [sources]:
        known = {**sources, **group}
        columns = [*zip(*_points([key or name, *places], known), strict=True)]
        if not columns:
            continue
        if len(places) == 1:
            columns.insert(role == "gap", ())
        x, y, *more = columns
        across = any(isinstance(value, Measured) for value in x)
        expanded = (value.expanded for value in (x if across else y) if isinstance(value, Measured))
        kind, color = _written(role, known), _written(paint, known)
        widths = [scale * (width or 0.0) for width in (more[0] if more else expanded)]
        yield Trace(
            _written(label, known),
            _floats(x, scale if across or known.get("true") else 1.0),
            _floats(y, 1.0 if across else scale),
            kind,
            int(color) if color.isdigit() else getattr(looks, color.upper()),
            **{"base" if role == "bar" else "u": [] if kind in _BARE else widths},
            across=across,
        )


def _points(cells: Sequence[str], sources: Mapping[str, Any]) -> list[Sequence[Any]]:
    """Find the coordinates of all records that have both, or of columns of equal length."""
    name, *places = (_written(cell, sources) for cell in cells)
    if name == "-":
        columns = [value_at(sources, place) for place in places]
        return [] if any(column is None for column in columns) else [*zip(*columns, strict=True)]
    rows = ([value_at(record, place) for place in places] for record in sources.get(name, ()))
    return [row for row in rows if None not in row[:2]]


def _floats(values: Iterable[Any], scale: float) -> list[float]:
    return [scale * float(getattr(value, "value", value)) for value in values]


def _written(cell: str, values: Mapping[str, Any]) -> str:
    return cell.strip('"').replace("\\n", "\n").format(**values)


def residual_panels(x: PlotAxis, ratios: Iterable[Sequence[float]]) -> list[Panel]:
    """Draw the panel below a curve: what is left over in units of U, ±1 shaded.

    Parameters
    ----------
    ratios
        Each at its place; those that are no numbers are left out, for there is no U.

    Returns
    -------
    list of Panel
        None where there is nothing to show.
    """
    points = [point for point in ratios if math.isfinite(point[1])]
    most = 1.1 * max([2.0, *(abs(ratio) for _, ratio in points)])
    sources = {"ratios": points, "y_axis": {"limits": (-most, most)}, "x": x.label}
    sources["role"] = "mean" if len(points) <= _FEW else "points"
    return [replace(panel, x=x) for panel in chart("residuals", sources).panels]


def csv_table(figure: Chart) -> str:
    """Write all numbers of a figure as CSV, a row a point."""
    rows = [
        [number, panel.x.label, panel.y.label, series.label or series.role, *point]
        for number, panel in enumerate(figure.panels, 1)
        for series in panel.series
        for point in zip_longest(series.x, series.y, series.u, series.base)
    ]
    return csv_text(_COLUMNS, [dict(zip(_COLUMNS, row, strict=True)) for row in rows])
