"""Drawing in braille: a character has 2 × 4 dots of the same colour."""

import math
from collections.abc import Sequence
from itertools import groupby
from operator import itemgetter
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

COLUMNS, ROWS = 2, 4
"""Dots of a character."""
BLANK = 0x2800
_BITS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
_PLACES = {bit: (at % COLUMNS, at // COLUMNS) for at, bit in enumerate(_BITS.ravel().tolist())}


class Span(NamedTuple):
    """Text in a colour of the theme; empty for the default colour."""

    text: str
    color: str = ""
    bold: bool = False


Rows: TypeAlias = list[list[Span]]
"""Lines of characters from the top, each a list of spans."""


class Sheet:
    """Characters to draw on; if colours meet in a character, the last of `colors` is used.

    Parameters
    ----------
    width, height
        Size in characters.
    colors
        Colours of the theme, by name; an ink is an index into them.
    """

    def __init__(self, width: int, height: int, colors: Sequence[str]) -> None:
        self.width, self.height = width, height
        self._colors = colors
        self._bits = np.zeros((height, width), int)
        self._inks = np.full((height, width), -1)  # none
        self._letters: dict[tuple[int, int], Span] = {}

    def strokes(self, ends: NDArray[np.float64], inks: ArrayLike) -> None:
        """Draw straight lines.

        Parameters
        ----------
        ends
            Ends in dots from the top left, x before y; shape ``(lines, 2, 2)``. Lines that are not
            finite are left out, and lines are clipped at the edges.
        inks
            A single ink, or an ink for each line.
        """
        inks = np.broadcast_to(inks, len(ends))
        finite = np.isfinite(ends).all((1, 2))
        ends, inks = ends[finite], inks[finite]
        ways = ends[:, 1] - ends[:, 0]
        share = np.linspace(0.0, 1.0, 2 + math.ceil(np.abs(ways).max(initial=0.0)))
        dots = ends[:, None, 0] + share[:, None] * ways[:, None]
        self.dots(dots.reshape(-1, 2), np.repeat(inks, share.size))

    def dots(self, places: NDArray[np.float64], inks: ArrayLike) -> None:
        """Set dots.

        Parameters
        ----------
        places
            Places in dots from the top left, x before y; shape ``(dots, 2)``.
        inks
            A single ink, or an ink for each dot.
        """
        inks = np.broadcast_to(inks, len(places))
        spots = np.rint(places)
        inside = ((spots >= 0) & (spots < [self.width * COLUMNS, self.height * ROWS])).all(axis=1)
        x, y = spots[inside].astype(int).T
        at = y // ROWS, x // COLUMNS
        np.bitwise_or.at(self._bits, at, _BITS[y % ROWS, x % COLUMNS])
        np.maximum.at(self._inks, at, inks[inside])

    def write(self, row: int, column: int, span: Span) -> None:
        """Write text over the drawing."""
        for place, letter in enumerate(span.text, start=column):
            self._letters[row, place] = span._replace(text=letter)

    def rows(self) -> Rows:
        """Return the drawing."""
        return list(map(self._row, range(self.height)))

    def _row(self, row: int) -> list[Span]:
        cells = zip(self._bits[row].tolist(), self._inks[row].tolist(), strict=True)
        colors = *self._colors, ""
        # Every font has a blank.
        dots = (Span(chr(BLANK + bits) if bits else " ", colors[ink]) for bits, ink in cells)
        letters = (self._letters.get((row, column), dot) for column, dot in enumerate(dots))
        runs = groupby(letters, key=itemgetter(1, 2))
        return [Span("".join(letter.text for letter in run), *look) for look, run in runs]


def dots_of(letter: str) -> list[tuple[int, int]]:
    """Return the dots of a braille character, column before row; empty for other characters."""
    bits = ord(letter) - BLANK
    is_braille = 0 <= bits < 1 << COLUMNS * ROWS
    return [place for bit, place in _PLACES.items() if is_braille and bits & bit]
