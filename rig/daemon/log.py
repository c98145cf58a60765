"""The log on stderr: for a terminal, for systemd's journal, or for the file beside the socket."""

from __future__ import annotations

import logging
import os
import queue
import threading
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

_WAITING = 1000  # lines that a terminal which does not take them may be behind
_LAST_S = 1.0  # for the last lines, when it still does not


class StderrHandler(logging.Handler):
    """Writes in a thread of its own.

    A terminal may stop taking lines at any time, and clients must not wait for it.
    """

    def __init__(self) -> None:
        super().__init__()
        self._lines: queue.Queue[str | None] = queue.Queue(_WAITING)
        self._writer = threading.Thread(target=self._write, name="log", daemon=True)
        self._writer.start()

    def emit(self, record: logging.LogRecord) -> None:
        """Write a line when it can be written; when too many wait, never."""
        with suppress(queue.Full):
            self._lines.put_nowait(self.format(record))

    def close(self) -> None:
        """Let the last lines go out."""
        with suppress(queue.Full):
            self._lines.put_nowait(None)
            self._writer.join(_LAST_S)
        super().close()

    def _write(self) -> None:
        while (line := self._lines.get()) is not None:
            with suppress(OSError):
                os.write(2, f"{line}\n".encode())  # past Python's buffer and its lock


@contextmanager
def logged_to_stderr() -> Iterator[None]:
    """Show what this program logs for the time of a block."""
    root, ours, handler = logging.getLogger(), logging.getLogger("rig"), StderrHandler()
    before = ours.level
    ours.setLevel(logging.INFO)
    root.addHandler(handler)
    try:
        yield
    finally:
        root.removeHandler(handler)
        ours.setLevel(before)
        handler.close()
