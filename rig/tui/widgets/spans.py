"""Widget for lines of coloured spans, without the wrapping and styling of other text."""

from collections.abc import Sequence
from functools import lru_cache

from rich.segment import Segment
from rich.style import Style
from textual.geometry import Region
from textual.strip import Strip
from textual.widget import Widget

from rig.tui.braille import Span


class SpanView(Widget):
    """Widget that shows lines of spans, for content that changes many times a second."""

    _rows: Sequence[Sequence[Span]] = ()
    _plain = Style()

    def take(self, rows: Sequence[Sequence[Span]]) -> None:
        """Show other lines."""
        if rows != self._rows:
            self._rows = rows
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
