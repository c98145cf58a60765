"""Colours of all figures, on light and dark pages, as named in `looks.txt`."""

from rig.text_rows import read_rows

COLORS = [colors for _, *colors in read_rows(__file__, mark=None)]
INK, MODEL, SECOND = 0, 1, 2
PARTS = (1, 3, 4, 5, 6, 7)
"""Colours for the segments of stacked bars."""
REST, MUTED, RULE, PAPER = 8, 9, 10, 11

SIZE = 8.0
"""Font size in figures, points."""
