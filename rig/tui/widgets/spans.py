"""Widget for lines of coloured spans, without the wrapping and styling of other text."""

from collections.abc import Callable
from functools import lru_cache
from time import monotonic
from typing import Any

from rich.segment import Segment
from rich.style import Style
from textual.geometry import Region
from textual.strip import Strip
from textual.widget import Widget

from rig.tui.braille import Rows

PAUSE_S = 0.2
"""Least time between new pictures, s."""


class SpanView(Widget):
    """Lines of spans that fill the widget, for content that changes many times a second.

    Parameters
    ----------
    draw
        Returns the lines of some content, given also the width and height in characters.
    slow
        Whether other content is drawn at most once in `PAUSE_S`.
    more
        Attributes of any widget.
    """

    def __init__(self, draw: Callable[..., Rows], *, slow: bool, **more: Any) -> None:
        super().__init__(**more)
        self._draw, self._slow = draw, slow
        self._rows: Rows = []
        self._content: tuple[Any, ...] = ()
        self._at_s = -PAUSE_S
        self._plain = Style()

    def show(self, *content: Any) -> None:
        """Show other content."""
        if content != self._content and monotonic() - self._at_s >= PAUSE_S * self._slow:
            self._content, self._at_s = content, monotonic()
            self.on_resize()

    def on_resize(self) -> None:
        """Draw the content in the new size."""
        if self._content and self.size:
            self._rows = self._draw(*self._content, *self.size)
            self.refresh()

    def render_lines(self, crop: Region) -> list[Strip]:
        """Render lines in the widget's style, which is computed once for all of them."""
        self._plain = self.rich_style
        return super().render_lines(crop)

    def render_line(self, y: int) -> Strip:
        """Render a line."""
        plain, colors = self._plain, self.app.theme_variables
        row = self._rows[y] if y < len(self._rows) else ()
        line = [Segment(text, _style(plain, colors.get(color), bold)) for text, color, bold in row]
        return Strip(line).adjust_cell_length(self.size.width, plain)


@lru_cache(maxsize=256)
def _style(plain: Style, color: str | None, bold: bool) -> Style:
    return plain + Style(color=color, bold=bold or None)
