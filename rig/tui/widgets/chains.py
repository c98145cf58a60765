"""Both chains to scale, in dots of braille: a dot is as high as it is wide."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rig.tui.braille import COLUMNS, ROWS, Sheet, Span
from rig.tui.widgets.spans import SpanView

if TYPE_CHECKING:
    from rig.tui.scale import Drawing

_COLORS = ("foreground", "accent", "primary", "secondary", "success", "warning")


class ChainView(SpanView):
    """Draws a moment of a fall."""

    DEFAULT_CSS = "ChainView { width: 30; height: 1fr; padding: 0 1; }"

    def show(self, drawing: Drawing | None) -> None:
        """Draw, as large as there is room for; nothing with nothing to draw."""
        self.display = drawing is not None
        if drawing is not None:
            self.take(painted(drawing, self.size.width or 28, self.size.height or 18))


def painted(drawing: Drawing, width: int, height: int) -> list[list[Span]]:
    """Draw into so many columns and lines of characters, the last two lines in words."""
    rows = max(1, height - 2)
    scale = min(
        (ROWS * rows - 1) / (drawing.top_m - drawing.bottom_m),
        (COLUMNS * width - 1) / drawing.width_m,
    )
    top, strokes = drawing.top_m, drawing.strokes
    ends = np.array(
        [[(stroke.x, top - stroke.z), (stroke.to_x, top - stroke.to_z)] for stroke in strokes]
    )
    sheet = Sheet(width, rows, _COLORS)
    inks = np.array([_COLORS.index(stroke.color) for stroke in strokes], dtype=np.int64)
    sheet.strokes(scale * ends.reshape(-1, 2, 2), inks)
    apart = "" if drawing.apart_m is None else f"Δz {drawing.apart_m * 1e2:.1f} cm as it falls"
    words = [Span(apart, "success", bold=True)], [Span("left: measured  right: model", "accent")]
    return [*sheet.rows(), *words]
