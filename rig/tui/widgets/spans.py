"""Lines of a few coloured parts each, without the wrapping and styling of other text."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.segment import Segment
from rich.style import Style
from textual.strip import Strip
from textual.widget import Widget

if TYPE_CHECKING:
    from collections.abc import Sequence

    from textual.geometry import Size

    from rig.tui.braille import Span


class SpanView(Widget):
    """Shows spans, as many lines as there are; for what changes many times a second."""

    def __init__(self, *, id: str | None = None) -> None:  # noqa: A002
        super().__init__(id=id)
        self._rows: Sequence[Sequence[Span]] = []

    def take(self, rows: Sequence[Sequence[Span]]) -> None:
        """Show these instead."""
        if rows != self._rows:
            higher = len(rows) != len(self._rows)
            self._rows = rows
            self.refresh(layout=higher and self.styles.is_auto_height)

    @property
    def said(self) -> str:
        """What stands here."""
        return "\n".join("".join(span.text for span in row) for row in self._rows)

    def get_content_height(self, container: Size, viewport: Size, width: int) -> int:
        """As many lines as there are."""
        del container, viewport, width
        return len(self._rows)

    def render_line(self, y: int) -> Strip:
        """One line."""
        plain, colors = self.rich_style, self.app.theme_variables
        row = self._rows[y] if y < len(self._rows) else ()
        line = [
            Segment(span.text, plain + Style(color=colors.get(span.color), bold=span.bold or None))
            for span in row
        ]
        return Strip(line).adjust_cell_length(self.size.width, plain)
