"""One way to plot: curves, bands, marks, error bars and residuals, all on the same dots of braille.

An axis is a number of units a character: its ticks stand in the middle of the characters that name
them, and what is drawn lies where the tick says, to the dot.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from rig.tui.braille import COLUMNS, ROWS, Sheet, Span

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from rig.arrays import Array

    Numbers = Sequence[float] | Array

_COLORS = ("border", "foreground", "accent", "warning", "secondary", "primary", "success", "error")
"""Of series, the last above the others."""
_TICK_COLUMNS, _TICK_ROWS = 9, 2
"""Characters from one number at an axis to the next, at least."""
_ROOM = 0.04  # of an axis, above and below what is drawn
_STRIP_OF, _STRIP_LEAST, _STRIP_FROM = 4, 4, 12  # lines for one of residuals, and from how many on
_NEAR = 0.03  # of the axis: as near as the cursor must be to a mark for its value
_OUTSIDE = 4  # sheets: what is drawn farther away is drawn there
_SHAPES = {
    "●": [(x, y) for x in (-1, 0, 1) for y in (-1, 0, 1)],
    "+": [(0, 0), (-1, 0), (1, 0), (0, -1), (0, 1)],
    "×": [(0, 0), (-1, -1), (1, -1), (-1, 1), (1, 1)],
    "○": [(x, y) for x in (-1, 0, 1) for y in (-1, 0, 1) if x or y],
    "·": [(0, 0)],
}
"""Dots of each marker around its place."""
_MARK = {"line": "⠒⠒", "band": "⣿⣿"}
_CAP = np.array([[-1.0, 0.0], [1.0, 0.0]])  # of an error bar


class Series(NamedTuple):
    """Something to be drawn.

    Attributes
    ----------
    kind
        Line, band as wide as the errors, markers, or markers with error bars.
    color
        Name of a theme's colour.
    marker
        ``●``, ``○``, ``+``, ``×`` or ``·``; of lines and bands unused.
    label
        In the legend; empty for none.
    """

    kind: Literal["line", "band", "dots", "bars"]
    x: Numbers
    y: Numbers
    color: str = "foreground"
    marker: str = "●"
    label: str = ""
    errors: Numbers = ()


class Picture(NamedTuple):
    """Everything a figure shows.

    Attributes
    ----------
    y_label, x_label
        What is drawn, with its unit.
    counts
        Whether the horizontal axis counts something, so that its numbers are whole.
    residuals
        What is drawn in a strip below, if anything.
    residual_label
        What that is, with its unit.
    """

    y_label: str
    x_label: str
    series: tuple[Series, ...]
    x_limits: tuple[float | None, float | None] = (None, None)
    counts: bool = False
    residuals: tuple[Series, ...] = ()
    residual_label: str = ""


class Axis(NamedTuple):
    """Units a character, such that numbers stand in the middle of characters.

    Attributes
    ----------
    unit
        Of one character.
    first
        Number of units in the middle of the first character, from below or from the left.
    cells
        Characters.
    every
        Characters from one tick to the next.
    """

    unit: float
    first: int
    cells: int
    every: int

    def at(self, values: Numbers, dots: int) -> Array:
        """Where values are, in dots from the axis' beginning, with so many a character."""
        place = np.asarray(values, dtype=np.float64) / self.unit - self.first
        return np.clip(place, -_OUTSIDE * self.cells, _OUTSIDE * self.cells) * dots + _middle(dots)

    def value(self, cell: float) -> float:
        """Value in the middle of a character."""
        return self.unit * (self.first + cell)

    @property
    def ticks(self) -> dict[int, float]:
        """The number of each character that has one."""
        begin = -self.first % self.every
        return {
            cell: float(f"{self.value(cell):.9g}") for cell in range(begin, self.cells, self.every)
        }


def _middle(dots: int) -> float:
    return 0.5 * (dots - 1)


def axis_over(low: float, high: float, cells: int, least: int, *, whole: bool = False) -> Axis:
    """Find the axis that shows a range as large as there is room.

    Parameters
    ----------
    low, high
        Ends, low < high.
    cells
        Characters.
    least
        Characters from one tick to the next, at least.
    whole
        Whether ticks are whole numbers only.
    """
    power = math.floor(math.log10((high - low) / cells))
    steps = [share * 10.0**exponent for exponent in range(power, power + 4) for share in (1, 2, 5)]
    axes = []
    for step in steps if not whole else [step for step in steps if step >= 1.0] or [1.0]:
        most = min(cells, math.floor(step * (cells - 1) / (high - low)))
        for every in range(most, max(0, most - 3), -1):
            unit = step / every
            first = math.floor(low / unit + 0.5)
            axis = Axis(unit, first, cells, every)
            if every >= least and high <= axis.value(cells - 0.5) and len(axis.ticks) > 1:
                axes.append(axis)
                break
    fallback = Axis((high - low) / max(1, cells - 1), 0, cells, max(1, cells))
    many = [axis for axis in axes if len(axis.ticks) > 2] or axes
    return min(many, key=lambda axis: axis.unit, default=fallback)


class Plot(NamedTuple):
    """A picture as characters.

    Attributes
    ----------
    rows
        Legend, plot, strip of residuals and horizontal axis, a list of spans a line.
    margin
        Characters left of what is drawn.
    axis
        The horizontal one.
    """

    rows: list[list[Span]]
    margin: int
    axis: Axis


def plotted(picture: Picture, width: int, height: int, cursor: float | None = None) -> Plot:
    """Draw a picture.

    Parameters
    ----------
    width, height
        In characters.
    cursor
        Where on the horizontal axis values are read off; `None` for nowhere.
    """
    strip = _strip(picture, height)
    rows = max(1, height - 3 - strip)
    upright = axis_over(*_roomy(picture.series), rows, min(_TICK_ROWS, max(1, rows // 3)))
    lower = axis_over(*_roomy(picture.residuals, level=0.0), max(1, strip - 1), 1)
    numbers = [*upright.ticks.values(), *(lower.ticks.values() if strip else ())]
    margin = 1 + max((len(_number(value)) for value in numbers), default=0)
    columns = max(1, width - margin - 1)
    x = axis_over(*spread(picture), columns, _TICK_COLUMNS, whole=picture.counts)
    out = [_legend(picture, cursor, width), *_panel(picture.series, x, upright, cursor, margin)]
    if strip:
        head = f" {picture.residual_label} "[:columns]
        out.append([Span(" " * margin + "├" + head + "╌" * (columns - len(head)))])
        out += _panel(picture.residuals, x, lower, cursor, margin)
    return Plot([*out, *_foot(picture.x_label, x, margin)], margin + 1, x)


def spread(picture: Picture) -> tuple[float, float]:
    """Take the horizontal ends that are given, or those of the data."""
    given_low, given_high = picture.x_limits
    values = [float(value) for series in picture.series for value in series.x]
    low = min(values, default=0.0) if given_low is None else given_low
    high = max(values, default=1.0) if given_high is None else given_high
    return (low, high) if low < high else (low - 0.5, low + 0.5)


def _legend(picture: Picture, cursor: float | None, width: int) -> list[Span]:
    """Say what is drawn, and what it is at the cursor."""
    low, high = spread(picture)
    at = "" if cursor is None else f"  {picture.x_label} {_number(cursor)}"
    parts = [Span(picture.y_label, bold=True), Span(at)]
    for curve in picture.series:
        if curve.label and len(curve.x):
            mark = Span(f"  {_MARK.get(curve.kind, curve.marker)}", curve.color, bold=True)
            value = "" if cursor is None else _read(curve, cursor, _NEAR * (high - low))
            parts += [mark, Span(f" {curve.label}"), Span(f" {value}" * bool(value), curve.color)]
    spans = []
    for part in parts:
        spans.append(part._replace(text=part.text[: max(0, width)]))
        width -= len(part.text)
    return spans


def _number(value: float) -> str:
    return f"{value:.4g}".replace("-", "−")


def _panel(
    series: Sequence[Series], x: Axis, y: Axis, cursor: float | None, margin: int
) -> Iterator[list[Span]]:
    """Draw series on one pair of axes, behind the upright one."""
    sheet = Sheet(x.cells, y.cells, _COLORS)
    if cursor is not None:
        down = np.arange(0, ROWS * y.cells, 2.0)
        across = np.full(down.size, float(x.at([cursor], COLUMNS)[0]))
        sheet.dots(np.column_stack([across, down]), 1)
    for curve in series:
        if len(curve.x):
            _draw(sheet, curve, x, y)
    for row, line in enumerate(sheet.rows()):
        value = y.ticks.get(y.cells - 1 - row)
        number = "" if value is None else _number(value)
        yield [Span(f"{number:>{margin}}{'┤' if number else '│'}"), *line]


def _places(x: Axis, y: Axis, across: Numbers, up: Numbers) -> Array:
    """Where points are on a sheet, in dots from the top left."""
    down = ROWS * y.cells - 1.0 - y.at(up, ROWS)
    return np.column_stack([x.at(across, COLUMNS), down])


def _draw(sheet: Sheet, curve: Series, x: Axis, y: Axis) -> None:
    ink = _COLORS.index(curve.color)
    places = _places(x, y, curve.x, curve.y)
    if curve.kind == "line":
        sheet.strokes(np.stack([places[:-1], places[1:]], axis=1), ink)
        return
    if curve.kind in {"band", "bars"}:
        values, off = np.asarray(curve.y), np.asarray(curve.errors, dtype=np.float64)
        tips = [_places(x, y, curve.x, values + sign * off) for sign in (-1.0, 1.0)]
        sheet.strokes(np.stack(tips, axis=1), ink)
        if curve.kind == "band":
            return
        for tip in tips:
            sheet.strokes(tip[:, None] + _CAP, ink)
    places = np.rint(places[np.isfinite(places).all(axis=1)])
    shape = np.array(_SHAPES[curve.marker], dtype=np.float64)
    sheet.dots((places[:, None] + shape).reshape(-1, 2), ink)


def _foot(label: str, axis: Axis, margin: int) -> Iterator[list[Span]]:
    """Write the horizontal axis with its numbers, as far as its name at the end leaves room."""
    line, below = ["─"] * axis.cells, [" "] * (margin + 1 + axis.cells)
    free = len(below) - len(label) - 1
    for column, value in axis.ticks.items():
        text = _number(value)
        line[column] = "┴"
        begin = margin + 1 + column - len(text) // 2
        if begin + len(text) <= free:
            below[begin : begin + len(text)] = text
    yield [Span(" " * margin + "└" + "".join(line))]
    yield [Span(("".join(below[: max(0, free)]) + f" {label}")[: len(below)])]


def _read(curve: Series, at: float, near: float) -> str:
    """Say what a series is at the cursor."""
    x, y = np.asarray(curve.x, dtype=np.float64), np.asarray(curve.y, dtype=np.float64)
    if curve.kind in {"line", "band"}:
        inside = x.size > 0 and x.min() <= at <= x.max()
        return _number(float(np.interp(at, x, y))) if inside else "–"
    point = int(np.argmin(np.abs(x - at)))
    if abs(x[point] - at) > near:
        return "–"
    bar = f" ± {curve.errors[point]:.2g}" if curve.kind == "bars" else ""
    return f"{_number(float(y[point]))}{bar}"


def _strip(picture: Picture, height: int) -> int:
    """Lines for the residuals, with what names them."""
    has_points = any(len(curve.x) for curve in picture.residuals)
    return max(_STRIP_LEAST, height // _STRIP_OF) if has_points and height >= _STRIP_FROM else 0


def _roomy(series: Sequence[Series], level: float | None = None) -> tuple[float, float]:
    """Give the upright axis room, and a span where all values are alike."""
    ends = [np.empty(0) if level is None else np.array([level])]
    for curve in series:
        values = np.asarray(curve.y, dtype=np.float64)
        off = np.asarray(curve.errors, dtype=np.float64) if len(curve.errors) else 0.0
        ends += [values - off, values + off]
    values = np.concatenate(ends)
    values = values[np.isfinite(values)]
    if not values.size:
        return 0.0, 1.0
    bottom, top = float(values.min()), float(values.max())
    room = _ROOM * (top - bottom) or 0.5 * abs(top) or 0.5
    return bottom - room, top + room
