"""A plot with its legend above and a cursor, drawn anew only when what it shows has changed."""

from __future__ import annotations

from time import monotonic
from typing import TYPE_CHECKING

from rig.tui.plotting import plotted, spread
from rig.tui.widgets.spans import SpanView

if TYPE_CHECKING:
    from textual import events

    from rig.tui.plotting import Picture

PAUSE_S = 0.2
"""Least time from one new picture to the next."""
_STEPS = 100  # of the cursor from end to end


class Figure(SpanView):
    """A picture, as large as there is room for."""

    DEFAULT_CSS = "Figure { width: 1fr; height: 1fr; min-height: 6; padding: 0 1 0 0; }"

    def __init__(self, *, id: str | None = None) -> None:  # noqa: A002
        super().__init__(id=id)
        self._drawn: object = None
        self._at = -PAUSE_S
        self._picture: Picture | None = None
        self._share: float | None = None  # of the horizontal axis, where the cursor is
        self._across = (0, 1)  # columns before the axis, and of it

    def wants(self, key: object) -> bool:
        """Whether what `key` stands for is not drawn yet, and the last drawing was long ago."""
        return key != self._drawn and monotonic() - self._at >= PAUSE_S

    def show(self, picture: Picture | None, key: object = None) -> None:
        """Draw; with no picture, give the room to others."""
        self._drawn, self._at = key, monotonic()
        self._picture = picture
        self.display = picture is not None
        self._draw()

    def step(self, by: int) -> None:
        """Move the cursor; the first step puts it into the middle."""
        self._put(0.5 if self._share is None else self._share + by / _STEPS)

    def point_at(self, value: float | None) -> None:
        """Put the cursor at a value of the horizontal axis, or take it away."""
        if self._picture is None:
            return
        low, high = spread(self._picture)
        self._put(None if value is None else (value - low) / (high - low))

    def _put(self, share: float | None) -> None:
        """Put the cursor at a share of the horizontal axis, or at its end, or take it away."""
        if share is not None:
            share = min(1.0, max(0.0, share))
        if share != self._share:
            self._share = share
            self._draw()

    def on_resize(self) -> None:
        """Draw for the new size."""
        self._draw()

    def on_click(self, event: events.Click) -> None:
        """Put the cursor there."""
        offset = event.get_content_offset(self)
        margin, columns = self._across
        if offset is not None:
            self._put((offset.x - margin + 0.5) / columns)

    def _draw(self) -> None:
        if self._picture is None or not self.size:
            return
        cursor = None
        if self._share is not None:
            low, high = spread(self._picture)
            cursor = low + self._share * (high - low)
        plot = plotted(self._picture, self.size.width, self.size.height, cursor)
        self._across = plot.margin, plot.columns
        self.take(plot.rows)
