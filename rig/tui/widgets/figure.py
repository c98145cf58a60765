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

    def __init__(self) -> None:
        super().__init__()
        self._at = -PAUSE_S
        self._picture: Picture | None = None
        self._share: float | None = None  # of the horizontal axis, where the cursor is
        self._margin, self._low, self._unit = 0, 0.0, 1.0  # of the drawn axis

    def show(self, picture: Picture | None) -> None:
        """Draw another picture, if the last one was long ago; with none, give the room away."""
        self.display = picture is not None
        if picture is not self._picture and (
            picture is None or self._picture is None or monotonic() - self._at >= PAUSE_S
        ):
            self._picture, self._at = picture, monotonic()
            self._draw()

    def step(self, by: int) -> None:
        """Move the cursor; the first step puts it into the middle."""
        self._put(0.5 if self._share is None else self._share + by / _STEPS)

    def point_at(self, value: float) -> None:
        """Put the cursor at a moment, where time is what the horizontal axis shows."""
        if self._picture is not None and "time" in self._picture.panel.x.label:
            self._put_at(value)

    def _put_at(self, value: float) -> None:
        if self._picture is not None:
            low, high = spread(self._picture)
            self._put((value - low) / (high - low))

    def _put(self, share: float) -> None:
        """Put the cursor at a share of the horizontal axis, or at its end."""
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
        if offset is not None:
            self._put_at(self._low + self._unit * (offset.x - self._margin))

    def _draw(self) -> None:
        if self._picture is None or not self.size:
            return
        cursor = None
        if self._share is not None:
            low, high = spread(self._picture)
            cursor = low + self._share * (high - low)
        plot = plotted(self._picture, self.size.width, self.size.height, cursor)
        self._margin, self._low, self._unit = plot.margin, plot.axis.value(0), plot.axis.unit
        self.take(plot.rows)
