"""Figures as plain data, independent of the drawing.

`rig.report.plot` draws them for pages and files, `csv_table` writes them as tables; neither adds
data.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import zip_longest
from typing import Any

from rig.analysis.result import Measured
from rig.report import looks
from rig.report.columns import read_tables, value_at
from rig.text_table import csv_text

COLUMN_PT, WIDE_PT = 244.0, 400.0
"""Width of a journal's column, 86 mm, also for telephones, and of a page."""
_FIGURES = dict(read_tables(__file__, "figures.txt"))
_FEW = 40  # most points that are drawn large
_LINES = {"zero": (0.0,), "unity": (-1.0, 1.0)}
_BARE = ("points", "cross")  # roles without bars
_COLUMNS = ("panel", "x_axis", "y_axis", "series", "x", "y", "U95", "begins")


@dataclass(frozen=True, slots=True)
class Trace:
    """A series of data drawn in the same way.

    Attributes
    ----------
    label
        Label beside the series; may be empty.
    x, y
        Coordinates in units of the axes.
    role
        Style. A `line`, `dash` or `thick` line joins its points, with a gap where one is not
        a number; a `band` fills y ± u; a `level` or `limit` is a line across the panel at each y; a
        `shade` fills the panel between two y, a `gap` between two x; `points` are small, `mean`,
        `ring` and `square` large, with bars of u; a `cross` does not set the scale; a `bar` lies
        from `base` to x; `words` are only the label, outwards from the point; a `map` shades the
        grid of x and y by z, in steps at the levels u, and `levels` are numbered lines there.
    u
        Half-widths along y, or along x if `across`.
    base
        Start of each bar.
    z
        Values of a grid, row by row.
    color
        Index into `rig.report.looks.COLORS`.
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
    """Series on two axes, with a height in points; neighbours with equal x axes share an axis.

    If `true`, both axes have the same scale.
    """

    x: PlotAxis
    y: PlotAxis
    series: list[Trace]
    height: float = 120.0
    true: bool = False

    @property
    def whole(self) -> bool:
        """Whether all x are whole numbers, such as those of runs."""
        return all(place.is_integer() for trace in self.series for place in trace.x)


@dataclass(frozen=True, slots=True)
class Chart:
    """Panels above each other.

    Attributes
    ----------
    title
        Title for screen readers.
    caption
        Line below the figure.
    simulated
        Whether to mark the figure as simulated.
    foot
        Lines below the panels of a separate figure.
    width
        Width as a file, points.
    facts
        Metadata of the file, for programs.
    """

    title: str
    caption: str
    panels: Sequence[Panel]
    simulated: bool = False
    foot: Sequence[str] = ()
    width: float = COLUMN_PT
    facts: str = ""


def chart(name: str, *panels: Mapping[str, Any], **values: object) -> Chart:
    """Return a figure as described in ``figures.txt``.

    Parameters
    ----------
    panels
        Data of panels, each for all panels of the figure: records of their series by name, values
        for labels, and options of both axes.
    values
        Values for title and caption.
    """
    title, caption, rows, _ = _FIGURES[name]
    drawn = [panel for sources in panels for panel in _panels(rows, {**_LINES, **sources})]
    return Chart(title.format(**values), caption.format(**values), drawn)


def _panels(rows: Iterable[Sequence[str]], sources: Mapping[str, Any]) -> list[Panel]:
    """Return panels from their rows, without panels that have only lines across, except maps."""
    panels: list[Panel] = []
    scale = 1.0
    for kind, *cells in rows:
        if kind == "panel":
            x, y, height, *factor = (_written(cell, sources) for cell in cells)
            scale = float(*factor or (1.0,))
            traces, true = [*sources.get("traces", ())], sources.get("true", False)
            labels = {"x_axis": x, "y_axis": y}.items()
            across, up = (PlotAxis(label, **sources.get(axis, {})) for axis, label in labels)
            panels.append(Panel(across, up, traces, float(height), true))
        elif kind == "residuals":
            panels += residual_panels(panels[-1].x, _points(cells, sources))
        else:
            panels[-1].series.extend(_traces(kind, cells, sources, scale))
    return [each for each in panels if "traces" in sources or any(line.x for line in each.series)]


def _traces(
    role: str, cells: Sequence[str], sources: Mapping[str, Any], scale: float
) -> Iterator[Trace]:
    """Yield records as a single series, or each group of records as its own series."""
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
    """Return the coordinates of all records with both, or of columns of equal length."""
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
    """Return the panel below a curve: residuals in units of U, ±1 shaded.

    Parameters
    ----------
    ratios
        Residuals in units of U; NaN, for points without U, are left out.

    Returns
    -------
    list of Panel
        Empty without residuals.
    """
    points = [point for point in ratios if math.isfinite(point[1])]
    most = 1.1 * max([2.0, *(abs(ratio) for _, ratio in points)])
    sources = {"ratios": points, "y_axis": {"limits": (-most, most)}, "x": x.label}
    sources["role"] = "mean" if len(points) <= _FEW else "points"
    return [replace(panel, x=x) for panel in chart("residuals", sources).panels]


def csv_table(figure: Chart) -> str:
    """Return all numbers of a figure as CSV, a row for each point."""
    rows = [
        [number, panel.x.label, panel.y.label, series.label or series.role, *point]
        for number, panel in enumerate(figure.panels, 1)
        for series in panel.series
        for point in zip_longest(series.x, series.y, series.u, series.base)
    ]
    return csv_text([dict(zip(_COLUMNS, row, strict=True)) for row in rows], _COLUMNS)
