"""Conversion of drawn text to ASCII, for terminals and fonts without Unicode."""

import unicodedata

from rich.segment import Segment
from textual.color import Color
from textual.filter import LineFilter

from rig.tui.braille import ROWS, dots_of

_LIKE = str.maketrans(
    "✓✗⊘…·↓■●○◌▲▸▶◀‖→←↑☞━─╌│┤├┴└┃┏┓┗┛Δαβγκμσνχ±−–°×²³ₙ≤≥½",
    "+x/~.v#*o:!>><|><^>=--|++++|++++dabgkusnX~--'x23n<>/",
)
"""ASCII characters of the same width and meaning."""
_MANY = 5  # least number of dots shown as a full character


def in_ascii(text: str) -> str:
    """Return text in the same number of ASCII characters."""
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
    """Filter that converts every drawn line to ASCII."""

    def apply(self, segments: list[Segment], _background: Color) -> list[Segment]:
        """Return the segments of a line in ASCII."""
        return [Segment(in_ascii(text), style, control) for text, style, control in segments]
