"""Plots in the terminal: panels of the report's figures, in dots of braille.

An axis has a fixed number of units in each character. Its ticks are in the middle of their
characters, and data are drawn at their exact place, to the dot.

A frame of 440 points, 120 by 34, takes 5 ms; textual-plot 0.10 takes 16 ms, and has no bands.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np

from rig.arrays import Array
from rig.report.looks import MODEL, MUTED, SECOND
from rig.tui.braille import COLUMNS, ROWS, Rows, Sheet, Span

if TYPE_CHECKING:
    from rig.report.figure import Panel, PlotAxis, Trace

    Numbers = Sequence[float] | Array

Picture: TypeAlias = "tuple[Panel, ...]"
"""A panel, and below it that of its residuals, if any."""
_COLORS = ("border", "foreground", "accent", "warning", "secondary", "primary", "success", "error")
"""Colours of traces; the last is drawn above the others."""
_COLOR_OF: dict[str | int, str] = {MODEL: "accent", SECOND: "secondary", MUTED: "foreground"}
_COLOR_OF |= {"band": "border", "shade": "border", "cross": "error"}
"""Colours of some colours and roles of the report's figures."""
_ROLES = dict.fromkeys(("line", "dash", "thick", "level", "limit", "shade"), "⠒")
_ROLES |= {"band": "⣿", "points": "+", "cross": "×", "mean": "●", "ring": "○", "square": "●"}
"""Marks of the roles that are drawn: of a shade its edges; of gaps, maps and words nothing."""
_TICK_COLUMNS, _TICK_ROWS = 9, 2
"""Least number of characters between numbers on an axis."""
_ROOM = 0.04  # share of an axis left empty above and below the data
_STRIP_OF, _STRIP_LEAST, _STRIP_FROM = 4, 4, 12  # lines of residuals; shown from _STRIP_FROM on
_OUTSIDE = 4  # sheets: points further away are clipped to this distance
_SHAPES = {
    "●": [(x, y) for x in (-1, 0, 1) for y in (-1, 0, 1)],
    "+": [(0, 0), (-1, 0), (1, 0), (0, -1), (0, 1)],
    "×": [(0, 0), (-1, -1), (1, -1), (-1, 1), (1, 1)],
    "○": [(x, y) for x in (-1, 0, 1) for y in (-1, 0, 1) if x or y],
}
"""Dots of each marker around its place."""
_CAP = np.array([[-1.0, 0.0], [1.0, 0.0]])  # cap of an error bar


class CellAxis(NamedTuple):
    """Scale of an axis in characters, with numbers in the middle of characters.

    Attributes
    ----------
    unit
        Length of a character.
    first
        Number of units in the middle of the first character, from below or from the left.
    cells
        Number of characters.
    every
        Characters between ticks.
    """

    unit: float
    first: int
    cells: int
    every: int

    def at(self, values: Numbers, dots: int) -> Array:
        """Return places of values in dots from the axis' start, with `dots` for a character."""
        place = np.asarray(values, dtype=np.float64) / self.unit - self.first
        furthest = _OUTSIDE * self.cells
        return (np.clip(place, -furthest, furthest) + 0.5) * dots - 0.5

    def value(self, cell: float) -> float:
        """Return the value in the middle of a character."""
        return self.unit * (self.first + cell)

    @property
    def ticks(self) -> dict[int, float]:
        """Return the numbers at ticks, by character."""
        begin = -self.first % self.every
        return {
            cell: float(f"{self.value(cell):.9g}") for cell in range(begin, self.cells, self.every)
        }


def axis_over(low: float, high: float, cells: int, least: int, *, whole: bool = False) -> CellAxis:
    """Return the axis that shows a range as large as possible.

    Parameters
    ----------
    low, high
        Ends, low < high.
    cells
        Number of characters.
    least
        Least number of characters between ticks.
    whole
        Whether ticks are whole numbers only.
    """
    span = high - low
    power = math.floor(math.log10(span / cells))
    steps = [share * 10.0**exponent for exponent in range(power, power + 4) for share in (1, 2, 5)]
    axes = [
        CellAxis(step / every, math.floor(low * every / step + 0.5), cells, every)
        for step in steps
        if step >= 1.0 or not whole
        for every in range(least, 1 + min(cells, int(step * cells / span)))
    ]
    fitting = [axis for axis in axes if axis.value(cells - 0.5) >= high and len(axis.ticks) > 1]
    bare = CellAxis(span / max(1, cells - 1), 0, cells, cells)
    return min(fitting, key=lambda axis: (len(axis.ticks) < 3, axis.unit), default=bare)


def draw_picture(picture: Picture, moment: float | None, width: int, height: int) -> Rows:
    """Return a drawn picture.

    Parameters
    ----------
    moment
        Time of a vertical line, s; `None` for no line.
    width, height
        Size in characters.
    """
    panel, *residuals = panels = picture[: 1 + (height >= _STRIP_FROM)]
    strip = max(_STRIP_LEAST, height // _STRIP_OF) * len(residuals)
    rows = max(1, height - 3 - strip)
    sizes = (rows, min(_TICK_ROWS, max(1, rows // 3))), (strip - 1, 1)
    scales = [axis_over(*_heights(part), *size) for part, size in zip(panels, sizes, strict=False)]
    numbers = [_number(value) for y in scales for value in y.ticks.values()]
    margin = 1 + max(map(len, numbers), default=0)
    columns = max(1, width - margin - 1)
    ends = _limits(panel.x, ((trace.x, 0.5 * panel.whole) for trace in panel.series), 0.0)
    x = axis_over(*ends, columns, _TICK_COLUMNS, whole=panel.whole)
    out = [_legend(panel, width)]
    for part, y in zip(panels, scales, strict=True):
        if part is not panel:
            head = f" {part.y.label} ".replace("\n", " ")[:columns]
            out.append([Span(" " * margin + "├" + head + "╌" * (columns - len(head)))])
        out += _drawn(part, x, y, moment, margin)
    return [*out, *_foot(panel.x.label, x, margin)]


def _heights(panel: Panel) -> tuple[float, float]:
    """Return the vertical limits, with margins around the bars of the data."""
    drawn = [trace for trace in panel.series if trace.role in _ROLES]
    return _limits(panel.y, ((each.y, each.u if len(each.u) else 0.0) for each in drawn), _ROOM)


def _limits(
    axis: PlotAxis, bars: Iterable[tuple[Numbers, Numbers | float]], share: float
) -> tuple[float, float]:
    """Return the limits of an axis, or those of its data, and a span if all are equal.

    Parameters
    ----------
    bars
        Values, and how far each reaches to both sides.
    share
        Share of the span left empty beyond both ends.
    """
    ends = [np.asarray(axis.limits or (), dtype=np.float64)]
    for values, off in () if axis.limits else bars:
        ends += [np.subtract(values, off), np.add(values, off)]
    places = np.concatenate(ends)
    places = places[np.isfinite(places)]
    if not places.size:
        return 0.0, 1.0
    low, high = float(places.min()), float(places.max())
    room = share * (high - low) if low < high else 0.5 * abs(high) or 0.5
    return low - room, high + room


def _legend(panel: Panel, width: int) -> list[Span]:
    """Return the legend of a panel."""
    spans, used = [Span(panel.y.label.replace("\n", " ")[:width], bold=True)], len(panel.y.label)
    for trace in panel.series:
        used += len(trace.label) + 4
        if trace.label and trace.role in _ROLES and len(trace.y) and used <= width:
            mark = Span(f"  {_ROLES[trace.role]}", _color(trace), bold=True)
            spans += [mark, Span(f" {trace.label}")]
    return spans


def _color(trace: Trace) -> str:
    return _COLOR_OF.get(trace.role) or _COLOR_OF.get(trace.color, "primary")


def _number(value: float) -> str:
    return f"{value:.4g}".replace("-", "−")


def _drawn(
    panel: Panel, x: CellAxis, y: CellAxis, moment: float | None, margin: int
) -> Iterator[list[Span]]:
    """Yield the lines of traces on a pair of axes, with the vertical axis."""
    sheet = Sheet(x.cells, y.cells, _COLORS)
    if moment is not None and "time" in panel.x.label:
        down = np.arange(0, ROWS * y.cells, 2.0)
        across = x.at([moment] * down.size, COLUMNS)
        sheet.dots(np.column_stack([across, down]), 1)
    for trace in panel.series:
        if trace.role in _ROLES and len(trace.y):
            _draw(sheet, trace, x, y)
    for row, line in enumerate(sheet.rows()):
        value = y.ticks.get(y.cells - 1 - row)
        number = "" if value is None else _number(value)
        yield [Span(f"{number:>{margin}}{'┤' if number else '│'}"), *line]


def _draw(sheet: Sheet, trace: Trace, x: CellAxis, y: CellAxis) -> None:
    ink = _COLORS.index(_color(trace))
    values, off = np.asarray(trace.y, dtype=np.float64), np.asarray(trace.u, dtype=np.float64)
    down = ROWS * y.cells - 1.0 - y.at(values, ROWS)
    if trace.role in {"level", "limit", "shade"}:
        ends = np.array([[0.0, 0.0], [COLUMNS * x.cells - 1.0, 0.0]])
        sheet.strokes(ends + np.column_stack([0.0 * down, down])[:, None], ink)
        return
    places = np.column_stack([x.at(trace.x, COLUMNS), down])
    if len(off):
        ways = np.column_stack([0.0 * down, off / y.unit * ROWS])
        tips = [places - ways, places + ways]
        sheet.strokes(np.stack(tips, axis=1), ink)
        for tip in tips if trace.role != "band" else ():
            sheet.strokes(tip[:, None] + _CAP, ink)
    shape = _SHAPES.get(_ROLES[trace.role])
    if shape is not None:
        places = np.rint(places[np.isfinite(places).all(axis=1)])
        sheet.dots((places[:, None] + np.array(shape)).reshape(-1, 2), ink)
    elif not len(off):
        sheet.strokes(np.stack([places[:-1], places[1:]], axis=1), ink)


def _foot(label: str, axis: CellAxis, margin: int) -> Iterator[list[Span]]:
    """Yield the horizontal axis with its label, and its numbers below."""
    line, below = ["─"] * axis.cells, [" "] * (margin + 2 + axis.cells)
    for column, value in axis.ticks.items():
        text = _number(value)
        line[column] = "┴"
        begin = margin + 1 + column - len(text) // 2
        below[begin : begin + len(text)] = text
    name = f" {label} "[: axis.cells]
    line[axis.cells - len(name) :] = name
    yield [Span(" " * margin + "└" + "".join(line))]
    yield [Span("".join(below))]
