"""Colours of all figures, on light and dark pages, as named in `looks.txt`."""

from __future__ import annotations

from pathlib import Path

_ROWS = Path(__file__).with_suffix(".txt").read_text("utf-8").splitlines()
COLORS = [row.split()[1:] for row in _ROWS if not row.startswith("#")]
INK, MODEL, SECOND = 0, 1, 2
PARTS = (1, 3, 4, 5, 6, 7)
"""Colours for the segments of stacked bars."""
REST, MUTED, RULE, PAPER = 8, 9, 10, 11

SIZE = 8.0
"""Font size in figures, points."""
