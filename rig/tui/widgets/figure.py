"""A plot with a legend above, redrawn on change only and at most twice a second."""

from __future__ import annotations

import math
from contextlib import ExitStack
from time import monotonic
from typing import TYPE_CHECKING, Literal, NamedTuple

from textual.containers import Grid, Vertical
from textual.content import Content
from textual.reactive import reactive
from textual_hires_canvas import Canvas
from textual_plot import HiResMode, PlotWidget
from textual_plot.plot_widget import Legend

from rig.tui.widgets.text import Words

if TYPE_CHECKING:
    from collections.abc import Hashable, Sequence

    import numpy as np
    from numpy.typing import NDArray

    Numbers = Sequence[float] | NDArray[np.float64]

    from rich.style import Style
    from textual.app import ComposeResult, RenderResult
    from textual.geometry import Size

PAUSE_S = 0.5
"""Least time from one drawing to the next."""
_TICK_COLUMNS, _TICK_ROWS = 9, 2
"""What one number at an axis takes, with the room around it."""
_FEWEST = 3  # numbers at the upright axis, however low it is
_MOST = 300  # dots of a series: more would fall on the same characters


class Series(NamedTuple):
    """Something to be drawn.

    Attributes
    ----------
    kind
        Line, markers, or markers with error bars.
    color
        Name of a theme's colour.
    marker
        One character; of a line only for the legend.
    label
        In the legend; empty for none.
    """

    kind: Literal["line", "dots", "bars"]
    x: Numbers
    y: Numbers
    color: str = "foreground"
    marker: str = "•"
    label: str = ""
    errors: Numbers = ()


class Picture(NamedTuple):
    """Everything a figure shows."""

    title: str
    series: tuple[Series, ...]
    x_limits: tuple[float | None, float | None] = (None, None)
    y_limits: tuple[float | None, float | None] = (None, None)
    x_ticks: Sequence[float] | None = None


class _Sheet(Canvas):
    """Works its style out once a drawing; a canvas does for each of its lines."""

    def __init__(self, width: int, height: int, *, id: str) -> None:  # noqa: A002
        super().__init__(width, height, id=id)
        self._style: Style | None = None

    @property
    def rich_style(self) -> Style:
        """Of all its lines."""
        if self._style is None:
            self._style = super().rich_style
        return self._style

    def reset(self, size: Size | None = None, refresh: bool = True) -> None:
        """Begin anew."""
        self._style = None
        super().reset(size, refresh)


class _Plot(PlotWidget, can_focus=False):
    """Takes no keys, which belong to the table of actions, and paints once a drawing."""

    margin_top = reactive(0)
    margin_bottom = reactive(2)
    margin_left = reactive(7)

    DEFAULT_CSS = """
    _Plot { height: 1fr; }
    _Plot > .plot--axis { color: $foreground 50%; }
    _Plot > .plot--tick { color: $foreground 80%; text-style: none; }
    _Plot > .plot--label { color: $foreground 80%; text-style: none; }
    """

    def compose(self) -> ComposeResult:
        with Grid():
            for name in ("margin-top", "margin-left", "plot", "margin-bottom"):
                yield _Sheet(1, 1, id=name)
        yield Legend(id="legend")

    def render(self) -> RenderResult:
        with ExitStack() as stack:
            for canvas in self.query(Canvas):  # else each of its characters asks for a repaint
                stack.enter_context(canvas.batch_refresh())
            return super().render()


class Figure(Vertical):
    """A plot and its legend."""

    DEFAULT_CSS = """
    Figure { height: 1fr; min-height: 6; }
    Figure Words { height: 1; padding: 0 1; }
    """

    def __init__(self, *, id: str | None = None) -> None:  # noqa: A002
        super().__init__(id=id)
        self._drawn: Hashable = None
        self._at = -PAUSE_S

    def compose(self) -> ComposeResult:
        yield Words()
        yield _Plot(allow_pan_and_zoom=False)

    def on_resize(self) -> None:
        """Draw anew: how many numbers fit an axis has changed."""
        self._drawn = None

    def wants(self, key: Hashable) -> bool:
        """Whether what `key` stands for is not drawn yet, and the last drawing was long ago."""
        new = (key, self.app.theme, self.app.size) != self._drawn
        return new and monotonic() - self._at >= PAUSE_S

    def show(self, picture: Picture | None, key: Hashable = None) -> None:
        """Draw; with no picture, give the room to others."""
        self._drawn, self._at = (key, self.app.theme, self.app.size), monotonic()
        self.display = picture is not None
        if picture is None:
            return
        self.query_one(Words).say_content(legend(picture))
        self._draw(picture)

    def _draw(self, picture: Picture) -> None:
        colors = self.app.theme_variables
        plot = self.query_one(_Plot)
        plot.clear()
        for one in picture.series:
            if not len(one.x):
                continue
            color = colors.get(one.color, "#ffffff")
            if one.kind == "line":
                plot.plot(one.x, one.y, line_style=color, hires_mode=HiResMode.BRAILLE)
            elif one.kind == "bars":
                plot.errorbar(one.x, one.y, yerr=one.errors, marker=one.marker, marker_style=color)
            else:
                thin = slice(None, None, 1 + len(one.x) // _MOST)
                plot.scatter(one.x[thin], one.y[thin], marker=one.marker, marker_style=color)
        sideways, upwards = _spread(picture), _roomy(picture)
        size = plot.size
        columns, rows = size.width - plot.margin_left - 2, size.height - plot.margin_bottom - 2
        plot.set_xticks(picture.x_ticks or ticks(*sideways, columns // _TICK_COLUMNS))
        plot.set_yticks(ticks(*upwards, max(_FEWEST, rows // _TICK_ROWS)))
        plot.set_xlimits(*sideways)
        plot.set_ylimits(*upwards)


def legend(picture: Picture) -> Content:
    """Title and what each mark means."""
    parts: list[str | tuple[str, str]] = [(picture.title, "bold")]
    for one in picture.series:
        if one.label and len(one.x):
            mark = "⠒⠒" if one.kind == "line" else one.marker
            parts += ["  ", (mark, f"bold ${one.color}"), f" {one.label}"]
    return Content.assemble(*parts)


def ticks(low: float, high: float, most: int) -> list[float]:
    """Choose round numbers between two, at most about so many.

    Parameters
    ----------
    low, high
        Ends, low < high.
    most
        That fit; steps are 1, 2 or 5 times a power of ten.
    """
    rough = (high - low) / max(1, most)
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(step * power for step in (1, 2, 5, 10) if step * power >= rough)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [float(f"{number * step:.12g}") for number in range(first, last + 1)]


def _spread(picture: Picture) -> tuple[float, float]:
    """Take the horizontal ends that are given, or those of the data."""
    given_low, given_high = picture.x_limits
    values = [float(value) for one in picture.series for value in one.x]
    low = min(values, default=0.0) if given_low is None else given_low
    high = max(values, default=1.0) if given_high is None else given_high
    return (low, high) if low < high else (low - 0.5, low + 0.5)


def _roomy(picture: Picture) -> tuple[float, float]:
    """Give the vertical axis room, and a span where all values are alike."""
    low, high = picture.y_limits
    if low is not None and high is not None:
        return low, high
    values = [
        value + sign * error
        for one in picture.series
        for value, error in zip(one.y, one.errors or (0.0,) * len(one.y), strict=True)
        for sign in (-1, 1)
    ]
    values = [float(value) for value in values if value == value]  # not NaN  # noqa: PLR0124
    if not values:
        return 0.0, 1.0
    bottom, top = min(values), max(values)
    room = 0.06 * (top - bottom) or 0.5 * abs(top) or 0.5
    return (bottom - room if low is None else low), (top + room if high is None else high)
