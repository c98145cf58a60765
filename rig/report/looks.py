"""Colours of all figures, on light and on dark pages."""

from __future__ import annotations

COLORS = (
    ("#1f2328", "#e6e9ed"),
    ("#0062a3", "#5db8f0"),
    ("#b34700", "#ff9a55"),
    ("#e69f00", "#e69f01"),
    ("#009e73", "#1fb88c"),
    ("#cc79a7", "#cc79a8"),
    ("#56b4e9", "#3d8fc0"),
    ("#d9c72e", "#c9b82a"),
    ("#9aa3ad", "#77808a"),
    ("#59636e", "#a2acb7"),
    ("#d5dae0", "#363d46"),
    ("#fefefe", "#15191e"),
)
"""Each on a light and on a dark page; hues after Okabe and Ito, dark enough for text where they are
written in. Shapes and words say the same once more."""
INK, MODEL, SECOND = 0, 1, 2
PARTS = (1, 3, 4, 5, 6, 7)
"""Colours of parts of a whole."""
REST, MUTED, RULE, PAPER = 8, 9, 10, 11

SIZE = 8.0
"""Points, of all type in a figure."""
