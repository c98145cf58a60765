"""A plot with a legend above, redrawn on change only and at most four times a second."""

from __future__ import annotations

from time import monotonic
from typing import TYPE_CHECKING, Literal, NamedTuple

from textual.containers import Vertical
from textual.content import Content
from textual.reactive import reactive
from textual_plot import HiResMode, PlotWidget

from rig.tui.widgets.text import Words

if TYPE_CHECKING:
    from collections.abc import Hashable, Sequence

    import numpy as np
    from numpy.typing import NDArray

    Numbers = Sequence[float] | NDArray[np.float64]

    from textual.app import ComposeResult

_PAUSE_S = 0.25


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


class _Plot(PlotWidget, can_focus=False):
    """Keys belong to the table of actions, so this takes none."""

    margin_top = reactive(0)
    margin_bottom = reactive(2)
    margin_left = reactive(7)

    DEFAULT_CSS = """
    _Plot { height: 1fr; }
    _Plot > .plot--axis { color: $foreground 50%; }
    _Plot > .plot--tick { color: $foreground 80%; text-style: none; }
    _Plot > .plot--label { color: $foreground 80%; text-style: none; }
    """


class Figure(Vertical):
    """A plot and its legend."""

    DEFAULT_CSS = """
    Figure { height: 1fr; min-height: 6; }
    Figure Words { height: 1; padding: 0 1; }
    """

    def __init__(self, *, id: str | None = None) -> None:  # noqa: A002
        super().__init__(id=id)
        self._drawn: Hashable = None
        self._at = -_PAUSE_S

    def compose(self) -> ComposeResult:
        yield Words()
        yield _Plot(allow_pan_and_zoom=False)

    def wants(self, key: Hashable) -> bool:
        """Whether what `key` stands for is not drawn yet, and the last drawing was long ago."""
        new = (key, self.app.theme, self.app.size) != self._drawn
        return new and monotonic() - self._at >= _PAUSE_S

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
                plot.scatter(one.x, one.y, marker=one.marker, marker_style=color)
        plot.set_xticks(picture.x_ticks)
        plot.set_xlimits(*picture.x_limits)
        plot.set_ylimits(*_roomy(picture))


def legend(picture: Picture) -> Content:
    """Title and what each mark means."""
    parts: list[str | tuple[str, str]] = [(picture.title, "bold")]
    for one in picture.series:
        if one.label and len(one.x):
            mark = "⠒⠒" if one.kind == "line" else one.marker
            parts += ["  ", (mark, f"bold ${one.color}"), f" {one.label}"]
    return Content.assemble(*parts)


def _roomy(picture: Picture) -> tuple[float | None, float | None]:
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
