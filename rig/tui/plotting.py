"""One way to plot: curves, marks, error bars and residuals, all on the same dots of braille."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from rig.tui.braille import COLUMNS, ROWS, Sheet, Span

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Sequence

    from rig.arrays import Array

    Numbers = Sequence[float] | Array

_COLORS = ("foreground", "accent", "warning", "secondary", "primary", "success", "error")
"""Of series, the last above the others."""
_TICK_COLUMNS, _TICK_ROWS = 9, 3
"""What one number at an axis takes, with the room around it."""
_FEWEST = 3  # numbers at an axis, however short it is
_ROOM = 0.06  # of an axis, above and below what is drawn
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
_CAP = np.array([[-1.0, 0.0], [1.0, 0.0]])  # of an error bar


class Series(NamedTuple):
    """Something to be drawn.

    Attributes
    ----------
    kind
        Line, markers, or markers with error bars.
    color
        Name of a theme's colour.
    marker
        ``●``, ``○``, ``+``, ``×`` or ``·``; of a line unused.
    label
        At the line where there is room, or else in the legend; empty for none.
    """

    kind: Literal["line", "dots", "bars"]
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
    residuals
        What is drawn in a strip below, if anything.
    residual_label
        What that is, with its unit.
    """

    y_label: str
    x_label: str
    series: tuple[Series, ...]
    x_limits: tuple[float | None, float | None] = (None, None)
    x_ticks: Sequence[float] | None = None
    residuals: tuple[Series, ...] = ()
    residual_label: str = ""


class Plot(NamedTuple):
    """A picture as characters.

    Attributes
    ----------
    rows
        Legend, plot, strip of residuals and horizontal axis, a list of spans a line.
    margin
        Characters left of what is drawn.
    columns
        Characters of what is drawn.
    """

    rows: list[list[Span]]
    margin: int
    columns: int


class _Axis(NamedTuple):
    """One axis: its ends, and where on a sheet they are, in dots."""

    low: float
    high: float
    first: float
    last: float

    def at(self, values: Numbers) -> Array:
        """Where values are, in dots."""
        share = (np.asarray(values, dtype=np.float64) - self.low) / (self.high - self.low)
        reach = _OUTSIDE * abs(self.last - self.first)
        return np.clip(self.first + share * (self.last - self.first), -reach, reach)


def plotted(picture: Picture, width: int, height: int, cursor: float | None = None) -> Plot:
    """Draw a picture.

    Parameters
    ----------
    width, height
        In characters.
    cursor
        Where on the horizontal axis values are read off; `None` for nowhere.
    """
    lows, highs = spread(picture)
    strip = _strip(picture, height)
    upper, lower = _roomy(picture.series), _roomy(picture.residuals, level=0.0)
    rows = max(1, height - 3 - strip - (cursor is not None))
    upright = ticks(*upper, max(_FEWEST, rows // _TICK_ROWS))
    beside = ticks(*lower, _FEWEST) if strip else []
    margin = 1 + max(len(_number(value)) for value in (*upright, *beside))
    columns = max(1, width - margin - 1)
    x = _Axis(lows, highs, 0.0, COLUMNS * columns - 1.0)
    lines, labels = _panel(picture.series, columns, rows, x, upper, cursor)
    read = [] if cursor is None else [_readings(picture, cursor, width)]
    out = [legend(picture, labels, width), *read, *_framed(lines, upright, upper, margin)]
    if strip:
        rows_of_strip, _ = _panel(picture.residuals, columns, strip - 1, x, lower, cursor)
        head = f" {picture.residual_label} "[:columns]
        out.append([Span(" " * margin + "├" + head + "╌" * (columns - len(head)))])
        out += _framed(rows_of_strip, beside, lower, margin)
    return Plot([*out, *_foot(picture, x, columns, margin)], margin + 1, columns)


def spread(picture: Picture) -> tuple[float, float]:
    """Take the horizontal ends that are given, or those of the data."""
    given_low, given_high = picture.x_limits
    values = [float(value) for series in picture.series for value in series.x]
    low = min(values, default=0.0) if given_low is None else given_low
    high = max(values, default=1.0) if given_high is None else given_high
    return (low, high) if low < high else (low - 0.5, low + 0.5)


def legend(picture: Picture, labels: Collection[str], width: int) -> list[Span]:
    """Say what is drawn: the upright axis, then what each mark means.

    Parameters
    ----------
    labels
        Labels that stand where they belong.
    """
    parts = [Span(picture.y_label, bold=True)]
    for line in picture.series:
        if line.label and len(line.x) and line.label not in labels:
            parts += [Span("  "), Span(_mark(line), line.color, bold=True), Span(f" {line.label}")]
    return _cut(parts, width)


def _readings(picture: Picture, cursor: float, width: int) -> list[Span]:
    """Say what each series is at the cursor, by name or, where there is no room, by mark."""
    low, high = spread(picture)
    curves = [curve for curve in picture.series if curve.label and len(curve.x)]
    values = [_read(curve, cursor, _NEAR * (high - low)) for curve in curves]
    parts = [Span(f"{picture.x_label} {_number(cursor)}")]
    names = [curve.label for curve in curves]
    if sum(map(len, (parts[0].text, *names, *values))) + 3 * len(names) > width:
        names = [_mark(curve) for curve in curves]
    for curve, name, value in zip(curves, names, values, strict=True):
        parts += [Span(f"  {name} ", curve.color), Span(value, curve.color, bold=True)]
    return _cut(parts, width)


def _number(value: float) -> str:
    return f"{value:.4g}".replace("-", "−")


def _mark(curve: Series) -> str:
    return "⠒⠒" if curve.kind == "line" else curve.marker


def ticks(low: float, high: float, limit: int) -> list[float]:
    """Choose round numbers between two, at least three and otherwise at most so many.

    Parameters
    ----------
    low, high
        Ends, low < high.
    limit
        That fit; steps are 1, 2 or 5 times a power of ten.
    """
    power = 10.0 ** math.floor(math.log10(high - low))
    chosen: list[float] = []
    for step in (share * power for power in (power, power / 10.0) for share in (5, 2, 1)):
        first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
        values = [float(f"{number * step:.12g}") for number in range(first, last + 1)]
        if len(chosen) >= _FEWEST and len(values) > limit:
            break
        chosen = values
    return chosen


def _panel(
    series: Sequence[Series],
    columns: int,
    rows: int,
    x: _Axis,
    ends: tuple[float, float],
    cursor: float | None,
) -> tuple[list[list[Span]], set[str]]:
    """Draw series on one pair of axes; and say which labels were written there."""
    sheet = Sheet(columns, rows, _COLORS)
    y = _Axis(*ends, ROWS * rows - 1.0, 0.0)
    if cursor is not None:
        down = np.arange(0, ROWS * rows, 2.0)
        across = np.full(down.size, float(x.at([cursor])[0]))
        sheet.dots(np.column_stack([across, down]), 0)
    for curve in series:
        if len(curve.x):
            _draw(sheet, curve, x, y)
    labels = {curve.label for curve in series if _named(sheet, curve, x, y)}
    return sheet.rows(), labels


def _draw(sheet: Sheet, curve: Series, x: _Axis, y: _Axis) -> None:
    ink = _COLORS.index(curve.color)
    places = np.column_stack([x.at(curve.x), y.at(curve.y)])
    if curve.kind == "line":
        sheet.strokes(np.stack([places[:-1], places[1:]], axis=1), ink)
        return
    if curve.kind == "bars":
        off = np.asarray(curve.errors, dtype=np.float64)
        for sign in (-1.0, 1.0):
            tips = np.column_stack([places[:, 0], y.at(np.asarray(curve.y) + sign * off)])
            sheet.strokes(np.stack([places, tips], axis=1), ink)
            sheet.strokes(tips[:, None] + _CAP, ink)
    places = np.rint(places[np.isfinite(places).all(axis=1)])
    shape = np.array(_SHAPES[curve.marker], dtype=np.float64)
    sheet.dots((places[:, None] + shape).reshape(-1, 2), ink)


def _named(sheet: Sheet, curve: Series, x: _Axis, y: _Axis) -> bool:
    """Write a line's name beside it, where nothing else is drawn; whether there was room."""
    if curve.kind != "line" or not curve.label or not len(curve.x):
        return False
    across, up = x.at(curve.x), y.at(curve.y)
    finite = np.flatnonzero(np.isfinite(across) & np.isfinite(up))
    length = len(curve.label)
    for point in finite[:: -max(1, finite.size // 16)]:
        row, end = int(up[point]) // ROWS, int(across[point]) // COLUMNS
        for at, column in ((row - 1, end - length), (row + 1, end - length), (row - 1, end)):
            if sheet.free(at, column, length):
                sheet.write(at, column, Span(curve.label, curve.color))
                return True
    return False


def _framed(
    lines: list[list[Span]], numbers: Sequence[float], ends: tuple[float, float], margin: int
) -> Iterator[list[Span]]:
    """Set the upright axis before the lines of a panel."""
    axis = _Axis(*ends, ROWS * len(lines) - 1.0, 0.0)
    where = {round(float(axis.at([value])[0])) // ROWS: value for value in numbers}
    for row, line in enumerate(lines):
        number = _number(where[row]) if row in where else ""
        yield [Span(f"{number:>{margin}}{'┤' if number else '│'}"), *line]


def _foot(picture: Picture, x: _Axis, columns: int, margin: int) -> Iterator[list[Span]]:
    """Write the horizontal axis with its numbers, and what it is where there is most room right."""
    numbers = picture.x_ticks or ticks(x.low, x.high, max(_FEWEST, columns // _TICK_COLUMNS))
    line, below = ["─"] * columns, [" "] * (margin + 1 + columns)
    used = -1
    for value in numbers:
        column, text = round(float(x.at([value])[0])) // COLUMNS, _number(value)
        if not 0 <= column < columns:
            continue
        line[column] = "┴"
        begin = min(max(0, margin + 1 + column - len(text) // 2), len(below) - len(text))
        if begin > used:
            below[begin : begin + len(text)] = text
            used = begin + len(text)
    written, room = "".join(below), " " * (len(picture.x_label) + 2)
    at = (written + " ").rfind(room)
    at = len(written) - len(room) if at < 0 else at
    label = picture.x_label[: len(written)]
    written = f"{written[: at + 1]}{label}{written[at + 1 + len(label) :]}"[: len(below)]
    yield [Span(" " * margin + "└" + "".join(line))]
    yield [Span(written)]


def _read(curve: Series, at: float, near: float) -> str:
    """Say what a series is at the cursor."""
    x, y = np.asarray(curve.x, dtype=np.float64), np.asarray(curve.y, dtype=np.float64)
    if curve.kind == "line":
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


def _cut(parts: Sequence[Span], width: int) -> list[Span]:
    """Take what fits one line."""
    spans = []
    for part in parts:
        spans.append(part._replace(text=part.text[: max(0, width)]))
        width -= len(part.text)
    return spans
