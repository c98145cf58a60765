"""How far a sweep is: one line of a terminal, or a few lines of a log."""

from __future__ import annotations

import time
from contextlib import suppress
from typing import TYPE_CHECKING, TextIO

if TYPE_CHECKING:
    from collections.abc import Callable

_REDRAW_S = 0.1
_QUIET_S = 2.0  # what takes no longer needs no log lines


class Progress:
    """Shows the share of the points that is done, their rate and the time left.

    Parameters
    ----------
    size
        Number of points.
    stream
        Where to show it: on a terminal one line, rewritten; elsewhere a line a quarter.
    clock
        Seconds, from any origin.
    """

    def __init__(
        self, size: int, stream: TextIO, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._size, self._stream, self._clock = size, stream, clock
        self._terminal = stream.isatty()
        self._start = self._last = clock()
        self._quarter = 0
        self._drawn = False

    def show(self, done: int) -> None:
        """Take note of `done` points, and show it if it is time."""
        now = self._clock()
        quarter = 4 * done // self._size
        if self._terminal:
            due = now - self._last >= _REDRAW_S
        else:
            due = now - self._last >= _QUIET_S and self._quarter < quarter < 4
        if not due:
            return
        self._last, self._quarter, self._drawn = now, quarter, True
        rate = done / (now - self._start)
        left = (self._size - done) / rate
        line = f"{done / self._size:4.0%} of {self._size} points, {rate:.3g}/s, {left:.0f} s left"
        self._write(f"\r{line}\x1b[K" if self._terminal else f"{line}\n")

    def clear(self) -> None:
        """Leave the terminal's line empty for what is said next."""
        if self._terminal and self._drawn:
            self._write("\r\x1b[K")

    def _write(self, text: str) -> None:
        with suppress(OSError):  # a sweep does not end because nobody looks any more
            self._stream.write(text)
            self._stream.flush()
