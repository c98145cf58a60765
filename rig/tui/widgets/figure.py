"""A plot with its legend above, drawn anew only when what it shows has changed."""

from __future__ import annotations

from time import monotonic
from typing import TYPE_CHECKING

from rig.tui.plotting import plotted
from rig.tui.widgets.spans import SpanView

if TYPE_CHECKING:
    from rig.tui.plotting import Picture

PAUSE_S = 0.2
"""Least time from one new picture to the next."""


class Figure(SpanView):
    """A picture, as large as there is room for."""

    def __init__(self) -> None:
        super().__init__()
        self._at = -PAUSE_S
        self._shown: tuple[Picture | None, float | None] = (None, None)

    def show(self, picture: Picture | None, moment: float | None) -> None:
        """Draw another picture, if the last one was long ago; with none, give the room away."""
        self.display = picture is not None
        if (picture, moment) != self._shown and monotonic() - self._at >= PAUSE_S:
            self._shown, self._at = (picture, moment), monotonic()
            self.on_resize()

    def on_resize(self) -> None:
        """Draw for the new size."""
        picture, moment = self._shown
        if picture is not None and self.size:
            self.take(plotted(picture, *self.size, moment))
