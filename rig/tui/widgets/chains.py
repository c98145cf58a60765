"""Both chains to scale, in dots of braille: a dot is as high as it is wide."""

from __future__ import annotations

import math
from itertools import groupby
from operator import itemgetter
from typing import TYPE_CHECKING

import numpy as np
from textual.content import Content

from rig.tui.widgets.text import Words

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rig.tui.scale import Drawing

_COLUMNS, _ROWS = 2, 4  # dots of one character
_BITS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
_BLANK = 0x2800
_COLORS = ("foreground", "accent", "primary", "secondary", "success", "warning")
"""Where several share a character, the last of these colours is taken."""


class ChainView(Words):
    """Draws a moment of a fall."""

    DEFAULT_CSS = "ChainView { width: 30; height: 1fr; padding: 0 1; }"

    def show(self, drawing: Drawing | None) -> None:
        """Draw, as large as there is room for; nothing with nothing to draw."""
        self.display = drawing is not None
        if drawing is not None:
            size = self.content_size
            self.say_content(painted(drawing, size.width or 28, size.height or 18))


def painted(drawing: Drawing, width: int, height: int) -> Content:
    """Draw into so many columns and lines of characters, the last line in words."""
    rows = max(1, height - 1)
    scale = min(
        (_ROWS * rows - 1) / (drawing.top_m - drawing.bottom_m),
        (_COLUMNS * width - 1) / drawing.width_m,
    )
    cells, inks = _dots(drawing, scale, rows, width)
    lines = []
    for row, colors in zip(cells, inks, strict=True):
        parts = groupby(zip(colors.tolist(), row.tolist(), strict=True), key=itemgetter(0))
        lines.append(
            Content.assemble(
                *(
                    (
                        "".join(chr(_BLANK + bits) for _, bits in dots),
                        f"${_COLORS[ink]}" * (ink >= 0),
                    )
                    for ink, dots in parts
                )
            )
        )
    apart = "" if drawing.apart_m is None else f"Δz {drawing.apart_m * 1e2:.1f} cm"
    lines.append(Content.assemble((apart, "bold $success"), ("  beside: model", "$accent")))
    return Content("\n").join(lines)


def _dots(
    drawing: Drawing, scale: float, rows: int, width: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Set the dots of all strokes at once; dots and colour of each character."""
    top = drawing.top_m
    ends = np.array([[(one.x, top - one.z), (one.to_x, top - one.to_z)] for one in drawing.strokes])
    ends = scale * ends.reshape(-1, 2, 2)
    colors = np.array([_COLORS.index(one.color) for one in drawing.strokes], dtype=np.int64)
    ways = ends[:, 1] - ends[:, 0]
    share = np.linspace(0.0, 1.0, 2 + math.ceil(np.abs(ways).max(initial=0.0)))
    dots = np.rint(ends[:, None, 0] + share[:, None] * ways[:, None]).astype(np.intp)
    inside = ((dots >= 0) & (dots < [width * _COLUMNS, rows * _ROWS])).all(axis=2)
    x, y = dots[inside].T
    at = y // _ROWS, x // _COLUMNS
    cells, inks = np.zeros((rows, width), dtype=np.int64), np.full((rows, width), -1)
    np.bitwise_or.at(cells, at, _BITS[y % _ROWS, x % _COLUMNS])
    np.maximum.at(inks, at, np.broadcast_to(colors[:, None], inside.shape)[inside])
    return cells, inks
