"""Where everything of a figure goes: paths and texts in points, for a given width.

Drawn once for a column of a journal, which is a telephone's width too, and once for a page.
"""

from __future__ import annotations

import math
import textwrap
from dataclasses import dataclass, field
from itertools import groupby, pairwise
from typing import TYPE_CHECKING, NamedTuple

from rig.report.looks import INK, MUTED, PAPER, RULE, SECOND, SIZE
from rig.report.numbers import MINUS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from rig.report.figure import Chart, Panel, PlotAxis, Trace

    Point = tuple[float, float]

COLUMN_PT = 244.0
"""86 mm."""
WIDE_PT = 400.0
_LETTER = 0.56 * SIZE  # mean width of the digits and letters of the fonts in question
_LINE = 1.25 * SIZE
_TICK_PT = 42.0  # from one number to the next, at least
_ROW_PT = 15.0
_NEAR_PT = 4.0
_MARGIN = 0.06  # of the range of the data, on both sides
_PLACES = 16  # along a series, where its label may stand
_ALL = ("line", "dash", "band", "points", "mean", "ring", "square", "bar")
_MARKS = {
    "points": ("small",), "mean": ("dot",), "ring": ("dot", "hole"), "square": ("block",),
    "cross": (),
}  # fmt: skip


class Path(NamedTuple):
    """Lines, areas or dots of one look and color."""

    look: str
    color: int
    lines: list[list[Point]]


class PlacedText(NamedTuple):
    """Words at a point; `anchor` is start, middle or end."""

    x: float
    y: float
    words: str
    anchor: str = "start"
    color: int = INK
    turned: bool = False


@dataclass(slots=True)
class PlacedFigure:
    """A figure laid out, y downwards."""

    width: float
    height: float = 0.0
    paths: list[Path] = field(default_factory=list)
    texts: list[PlacedText] = field(default_factory=list)


def lay_out(figure: Chart, width: float = COLUMN_PT) -> PlacedFigure:
    """Lay a figure out in a width, points."""
    drawing = PlacedFigure(width)
    if figure.simulated:
        drawing.texts.append(PlacedText(width - 2, SIZE, "SIMULATED DATA", "end", SECOND))
        drawing.height = _LINE
    left = 1.6 * _LINE + max(_widest(panel) for panel in figure.panels)
    followers: list[Panel | None] = [*figure.panels[1:], None]
    for panel, follower in zip(figure.panels, followers, strict=True):
        shared = [other for other in figure.panels if other.x == panel.x]
        frame = _Frame(panel, drawing, left, _range(panel.x, shared, horizontal=True))
        frame.draw(numbered=follower is None or follower.x != panel.x)
    for paragraph in figure.foot:
        for line in textwrap.wrap(paragraph, int(width / _LETTER), subsequent_indent="   "):
            drawing.height += _LINE
            drawing.texts.append(PlacedText(2.0, drawing.height, line))
    drawing.height += 4.0 if figure.foot else 0.0
    return drawing


class _Frame:
    """One panel: its place, its scales, and what is drawn into it."""

    def __init__(self, panel: Panel, drawing: PlacedFigure, left: float, across: Point) -> None:
        self.panel, self.drawing = panel, drawing
        self.left, self.right = left, drawing.width - 9.0
        self.top = drawing.height + 5.0
        self.bottom = self.top + panel.height
        self.x_range, self.y_range = across, _range(panel.y, [panel], horizontal=False)
        self.labels: list[tuple[float, float, float, float]] = []
        self.taken: list[Point] = []

    def x(self, value: float) -> float:
        low, high = self.x_range
        return self.left + (value - low) / (high - low) * (self.right - self.left)

    def y(self, value: float) -> float:
        low, high = self.y_range
        return self.bottom - (value - low) / (high - low) * (self.bottom - self.top)

    def draw(self, *, numbered: bool) -> None:
        self._axes(numbered=numbered)
        for series in self.panel.series:
            self._series(series)
        for series in self.panel.series:
            if series.role == "bar":
                self._label_bar(series)
            elif series.label:
                self._label(series)
        foot = (2.6 * _LINE if self.panel.x.label else 1.4 * _LINE) if numbered else 0.0
        self.drawing.height = self.bottom + foot + 3.0

    def _axes(self, *, numbered: bool) -> None:
        panel, texts = self.panel, self.drawing.texts
        rows = _ticks(panel.y, self.y_range, (self.bottom - self.top) / _ROW_PT)
        levels = [(self.y(value), words) for value, words in rows]
        grid = [] if panel.y.names else [[(self.left, y), (self.right, y)] for y, _ in levels]
        self.drawing.paths += [
            Path("thin", RULE, grid),
            Path("axis", MUTED, [[(self.left, self.bottom), (self.right, self.bottom)]]),
        ]
        texts += [PlacedText(self.left - 4, y + 0.36 * SIZE, words, "end") for y, words in levels]
        middle = (self.top + self.bottom) / 2
        for number, line in enumerate(panel.y.label.split("\n")):
            texts.append(PlacedText(SIZE + number * _LINE, middle, line, "middle", turned=True))
        if numbered:
            names = panel.x.names.values()
            room = max([_TICK_PT, *(len(name) * _LETTER + 6 for name in names)])
            columns = _ticks(panel.x, self.x_range, (self.right - self.left) / room)
            for value, words in columns:
                texts.append(PlacedText(self.x(value), self.bottom + _LINE + 1, words, "middle"))
            texts.append(
                PlacedText((self.left + self.right) / 2, self.bottom + 2.25 * _LINE, panel.x.label,
                     "middle")
            )  # fmt: skip
            ticks = [[(self.x(v), self.bottom), (self.x(v), self.bottom + 3)] for v, _ in columns]
            self.drawing.paths.append(Path("axis", MUTED, ticks))

    def _add(self, look: str, color: int, lines: Iterable[list[Point]]) -> None:
        self.drawing.paths.append(Path(look, color, [line for line in lines if line]))

    def _series(self, series: Trace) -> None:
        places = list(zip(series.x, series.y, strict=False))
        if series.role in {"level", "limit"}:
            rows = [self.y(value) for value in series.y]
            self._add(series.role, series.color, [[(self.left, y), (self.right, y)] for y in rows])
            self.taken += [(x, y) for y in rows for x in _steps(self.left, self.right)]
        elif series.role == "shade":
            low, high = map(self.y, series.y)
            self._add("band", series.color, [_box(self.left, low, high, self.right)])
        elif series.role == "gap":
            self._add("band", series.color, [_box(self.x(series.x[0]), self.top, self.bottom,
                                                  self.x(series.x[1]))])  # fmt: skip
        elif series.role == "bar":
            half = 0.36 * abs(self.y(1.0) - self.y(0.0))
            ends = zip(series.base, places, strict=True)
            self._add("bar", series.color, [
                _box(self.x(base), self.y(y) - half, self.y(y) + half, self.x(x))
                for base, (x, y) in ends
            ])  # fmt: skip
        elif series.role == "band":
            sizes = list(zip(places, series.u, strict=True))
            edge = [(x, y + u) for (x, y), u in sizes] + [(x, y - u) for (x, y), u in sizes][::-1]
            self._add("band", series.color, [self._clipped(edge)])
        elif series.role in {"line", "dash"}:
            breaks = groupby(places, key=lambda place: math.isfinite(place[1]))
            lines = [self._clipped(part) for whole, part in breaks if whole]
            self._add(series.role, series.color, lines)
            self._take(lines)
        else:
            self._points(series, places)

    def _points(self, series: Trace, places: list[Point]) -> None:
        inside = [
            (self.x(x), self.y(y)) for x, y in places if self.y_range[0] <= y <= self.y_range[1]
        ]
        self.taken += inside
        if series.u:
            ends = [
                ((x - u, y), (x + u, y)) if series.across else ((x, y - u), (x, y + u))
                for (x, y), u in zip(places, series.u, strict=True)
            ]
            bars = [self._clipped(pair) for pair in ends]
            self._add("whisker", series.color, bars)
            self._take(bars)
        for look in _MARKS[series.role]:
            color = PAPER if look == "hole" else series.color
            self._add(look, color, [[place, place] for place in inside])
        if series.role == "cross":
            self._add("cross", series.color, [
                [(x - 2.2, y - 2.2 * way), (x + 2.2, y + 2.2 * way)]
                for x, y in inside for way in (1, -1)
            ])  # fmt: skip

    def _take(self, lines: Iterable[list[Point]]) -> None:
        """Keep labels away from lines."""
        for line in lines:
            for (x0, y0), (x1, y1) in pairwise(line):
                parts = max(1, int(math.hypot(x1 - x0, y1 - y0) / _NEAR_PT))
                self.taken += [
                    (x0 + (x1 - x0) * n / parts, y0 + (y1 - y0) * n / parts) for n in range(parts)
                ]

    def _clipped(self, line: Iterable[Point]) -> list[Point]:
        """Return a line on the drawing, no point of it above or below the panel."""
        return [
            (self.x(x), min(max(self.y(y), self.top), self.bottom))
            for x, y in line
            if math.isfinite(y)
        ]

    def _label(self, series: Trace) -> None:
        """Write a series' name beside it, where it hides least."""
        wide, best = len(series.label) * _LETTER, None
        across = (-wide / 2, 5.0, -wide - 5.0)
        offsets = [(dx, dy) for dy in (-4.0, SIZE + 3.0, 3.0) for dx in across]
        for x, y in self._anchors(series):
            for dx, dy in offsets:
                left, base = x + dx, y + dy
                box = left, base - 0.8 * SIZE, left + wide, base + 0.2 * SIZE
                if box[0] < self.left or box[2] > self.right + 4 or box[1] < self.top - 2:
                    continue
                hidden = sum(
                    box[0] - 2 < a < box[2] + 2 and box[1] - 1 < b < box[3] + 1
                    for a, b in self.taken
                )
                crowded = sum(_overlap(box, other) for other in self.labels)
                cost = hidden + 50 * crowded + 50 * (box[3] > self.bottom - 1)
                if best is None or cost < best[0]:
                    best = cost, box
        if best is not None:
            left, top = best[1][:2]
            self.labels.append(best[1])
            self.drawing.texts.append(
                PlacedText(left, top + 0.8 * SIZE, series.label, color=series.color)
            )

    def _label_bar(self, series: Trace) -> None:
        """Write a bar's name below its middle, in the first line that has room for it."""
        half = len(series.label) * _LETTER / 2
        middle = self.x((series.base[0] + series.x[0]) / 2)
        place = min(max(middle, self.left + half), self.right - half)
        foot = max(y for path in self.drawing.paths[-len(self.panel.series) :] for _, y in
                   path.lines[0])  # fmt: skip
        for line in range(1, 6):
            base = foot + 3 + line * _LINE
            box = (place - half - 3, base - 0.7 * SIZE, place + half + 3, base)
            if not any(_overlap(box, other) for other in self.labels):
                break
        self.labels.append(box)
        self._add("axis", series.color, [[(middle, foot), (middle, base - 0.8 * SIZE)]])
        self.drawing.texts.append(PlacedText(place, base, series.label, "middle"))

    def _anchors(self, series: Trace) -> list[Point]:
        if series.role in {"level", "limit", "shade"}:
            rows = [self.y(max(series.y))]
            return [(x, y) for y in rows for x in _steps(self.left, self.right)]
        if series.role == "gap":
            return [(self.x(sum(series.x) / 2), self.top + 2 * SIZE)]
        inside = [
            (self.x(x), self.y(y))
            for x, y in zip(series.x, series.y, strict=True)
            if self.y_range[0] <= y <= self.y_range[1]
        ]
        return inside[:: max(1, len(inside) // _PLACES)]


def _box(left: float, top: float, bottom: float, right: float) -> list[Point]:
    return [(left, top), (right, top), (right, bottom), (left, bottom)]


def _overlap(one: Sequence[float], other: Sequence[float]) -> bool:
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]


def _steps(low: float, high: float) -> list[float]:
    return [low + (high - low) * n / (2 * _PLACES) for n in range(1, 2 * _PLACES)]


def _widest(panel: Panel) -> float:
    """Room for the numbers or names on the left of a panel, points."""
    rows = _ticks(panel.y, _range(panel.y, [panel], horizontal=False), panel.height / _ROW_PT)
    lines = panel.y.label.count("\n") * _LINE
    return lines + max((len(words) for _, words in rows), default=0) * _LETTER


def _range(axis: PlotAxis, panels: Sequence[Panel], *, horizontal: bool) -> Point:
    """Return the limits of an axis: those it has, or what holds all points and a margin."""
    if axis.limits is not None:
        return axis.limits
    values = [
        value
        for panel in panels
        for series in panel.series
        for value in _values(series, horizontal=horizontal)
        if math.isfinite(value)
    ] or [0.0, 1.0]
    low, high = min(values), max(values)
    if high == low:
        low, high = low - 1.0, high + 1.0
    margin = (0.03 if horizontal else _MARGIN) * (high - low)
    return low - margin, high + margin


def _values(series: Trace, *, horizontal: bool) -> Iterator[float]:
    """Yield what of a series an axis has to hold."""
    if series.role in _ALL:
        values = series.x if horizontal else series.y
        yield from values
        yield from series.base if horizontal else ()
        if series.u and series.across == horizontal:
            for value, u in zip(values, series.u, strict=True):
                yield from (value - u, value + u)
    elif series.role in {"level", "limit", "shade"} and not horizontal:
        yield from series.y


def _ticks(axis: PlotAxis, limits: Point, most: float) -> list[tuple[float, str]]:
    """Return at most so many places with their names."""
    low, high = limits
    if axis.names:
        return [(value, name) for value, name in axis.names.items() if low <= value <= high]
    step = _step((high - low) / max(most, 1.0))
    step = max(step, 1.0) if axis.whole else step
    decimals = max(0, -math.floor(math.log10(step) + 1e-9))
    places = range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)
    write: Callable[[float], str] = lambda value: f"{value:.{decimals}f}".replace("-", MINUS)  # noqa: E731
    return [(n * step, write(n * step + 0.0)) for n in places]


def _step(least: float) -> float:
    """Return the least of 1, 2 and 5 times a power of ten that is no smaller."""
    power = 10.0 ** math.floor(math.log10(least))
    return power * next(times for times in (1.0, 2.0, 5.0, 10.0) if times * power >= 0.999 * least)
