"""What ``rig run`` shows on a terminal: Fig. 3 as it grows, in place of a line a drop."""

from __future__ import annotations

import sys
from shutil import get_terminal_size
from typing import TYPE_CHECKING, TextIO

from rig.analysis.curves import model_curves
from rig.analysis.session import Analysis
from rig.analysis.summary import summarize
from rig.commands.output import GO_ON, has_colours, tint
from rig.printable import printable
from rig.report.figures import result_figure
from rig.runner import narration
from rig.tui.plots import pictures_of
from rig.tui.plotting import plotted

if TYPE_CHECKING:
    from rig.analysis.result import DropResult
    from rig.protocol.protocol import Protocol
    from rig.tui.braille import Span

_ROWS = 13
"""Of a picture: two fit with what is said on 32 lines, one on the 24 of any terminal."""
_WIDEST = 100
_INKS = {"accent": "36", "primary": "34", "secondary": "90", "warning": "33", "error": "31"}


class Growing:
    """Narration on a terminal: what is odd stays, all else is drawn over.

    Parameters
    ----------
    protocol
        What is dropped.
    stream
        The terminal.
    """

    def __init__(self, protocol: Protocol, stream: TextIO) -> None:
        self._protocol = protocol
        self._stream = stream
        self._curves = model_curves(protocol)
        self._results: dict[int, DropResult] = {}
        self._last = ""
        self._height = 0  # lines below the cursor's line that may be drawn over

    def say(self, line: str) -> None:
        """Say something that stays."""
        self._wipe()
        self._write([tint(printable(line))])
        self._height = 0
        self._draw()

    def show_result(self, result: DropResult, planned: int) -> None:
        """Draw what came of a drop; one that does not count is said too."""
        self._results[result.run.number] = result
        line = narration(result, planned)
        if result.verdict != "accepted":
            self.say(line)
            return
        self._last = line
        self._wipe()
        self._draw()

    def ask(self, request: str) -> None:
        """Ask for something below the picture, and wait until it is done."""
        width = get_terminal_size().columns - 1
        self._write([request[:width]])
        print(GO_ON[:width], end="", file=self._stream, flush=True)
        if not sys.stdin.readline():
            raise KeyboardInterrupt
        self._height += 1  # Enter ended the second line

    def _wipe(self) -> None:
        if self._height:
            print(f"\x1b[{self._height}A\r\x1b[J", end="", file=self._stream)
        self._height = 0

    def _draw(self) -> None:
        if not self._results:
            return
        columns, rows = get_terminal_size()
        width = min(columns - 1, _WIDEST)
        runs = tuple(self._results[number] for number in sorted(self._results))
        analysis = Analysis(runs, (), tuple(summarize(self._protocol, runs)))
        drawn = pictures_of(result_figure(analysis, self._curves))
        lines = [
            "".join(map(_ink, row))
            for picture in drawn[: max(1, (rows - 6) // _ROWS)]
            for row in plotted(picture, width, _ROWS)
        ]
        self._write([*lines, self._last[:width]])

    def _write(self, lines: list[str]) -> None:
        print("\n".join(lines), file=self._stream, flush=True)
        self._height += len(lines)


def _ink(span: Span) -> str:
    if not has_colours() or span.color not in _INKS:
        return span.text
    return f"\x1b[{_INKS[span.color]}m{span.text}\x1b[0m"
