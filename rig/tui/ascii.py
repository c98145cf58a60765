"""For terminals and fonts without Unicode: everything that is drawn, in characters of ASCII."""

from __future__ import annotations

import unicodedata
from typing import TYPE_CHECKING

from rich.segment import Segment
from textual.filter import LineFilter

from rig.tui.braille import ROWS, dots_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from textual.color import Color

_LIKE = str.maketrans({
    "✓": "+", "✗": "x", "⊘": "/", "…": "~", "·": ".", "↓": "v", "■": "#", "●": "*", "○": "o",
    "◌": ":", "▲": "!", "▸": ">", "▶": ">", "◀": "<", "‖": "|", "→": ">", "←": "<", "↑": "^",
    "☞": ">", "━": "=", "─": "-", "╌": "-", "│": "|", "┤": "+", "├": "+", "┴": "+", "└": "+",
    "┃": "|", "┏": "+", "┓": "+", "┗": "+", "┛": "+", "Δ": "d", "α": "a", "β": "b", "γ": "g",
    "κ": "k", "μ": "u", "σ": "s", "ν": "n", "χ": "X", "±": "~", "−": "-", "–": "-", "°": "'",
    "×": "x", "²": "2", "³": "3", "ₙ": "n", "≤": "<", "≥": ">", "½": "/",
})  # fmt: skip
"""Characters of the same width that say the same."""
_MANY = 5  # dots that fill a character


def wanted(environment: Mapping[str, str]) -> bool:
    """Whether a terminal shows ASCII only, by its type or its locale."""
    if environment.get("TERM", "") in {"linux", "vt100", "vt220", "ansi", "dumb"}:
        return True
    names = ("LC_ALL", "LC_CTYPE", "LANG")
    locale = next((found for name in names if (found := environment.get(name))), "UTF-8")
    return "utf8" not in locale.casefold().replace("-", "")


def in_ascii(text: str) -> str:
    """Write text in as many characters of ASCII."""
    if text.isascii():
        return text
    return "".join(map(_character, text.replace(" ± ", "+/-").translate(_LIKE)))


def _character(letter: str) -> str:
    if letter.isascii():
        return letter
    dots = dots_of(letter)
    if dots:
        upper = [y < ROWS // 2 for _, y in dots]
        if len(dots) >= _MANY:
            return "#"
        return "'" if all(upper) else ":" if any(upper) else "."
    plain = unicodedata.normalize("NFKD", letter)[:1]
    return plain if plain.isascii() else "?"


class AsciiFilter(LineFilter):
    """Goes over every line that is drawn."""

    def apply(self, segments: list[Segment], background: Color) -> list[Segment]:
        """Write the segments of a line in ASCII."""
        del background
        return [Segment(in_ascii(text), style, control) for text, style, control in segments]
