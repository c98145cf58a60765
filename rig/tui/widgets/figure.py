"""A plot with its legend above, drawn again only if its content has changed."""

from time import monotonic

from rig.tui.plotting import Picture, draw_picture
from rig.tui.widgets.spans import SpanView

PAUSE_S = 0.2
"""Least time between new pictures, s."""


class Figure(SpanView):
    """A picture that fills its widget."""

    def __init__(self) -> None:
        super().__init__()
        self._at = -PAUSE_S
        self._shown: tuple[Picture, float | None] = ((), None)

    def show(self, picture: Picture, moment: float | None) -> None:
        """Draw another picture, at most once in `PAUSE_S`; hide the widget without a panel."""
        self.display = bool(picture)
        if (picture, moment) != self._shown and monotonic() - self._at >= PAUSE_S:
            self._shown, self._at = (picture, moment), monotonic()
            self.on_resize()

    def on_resize(self) -> None:
        """Draw the picture in the new size."""
        picture, moment = self._shown
        if picture and self.size:
            self.take(draw_picture(picture, *self.size, moment))
