"""Whether the file at a path is still the one that is open: files are moved, synced and deleted."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path


class Presence:
    """What was at a path when it was opened.

    SQLite goes on with a file that has no name any more: what is committed then is nowhere. A
    session only grows, so one that is smaller than it was has been cut.

    Parameters
    ----------
    path
        The session, open; its log (``-wal``) beside it.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._files = {one: _known(one) for one in (path, path.with_name(path.name + "-wal"))}
        self._size = path.stat().st_size

    def trouble(self) -> str:
        """Say in words what has become of it; empty while it is there."""
        for path, before in self._files.items():
            now = _known(path)
            if before is None:
                self._files[path] = now
            elif now is None:
                return f"{path} was deleted or moved"
            elif now != before:
                return f"{path} was replaced by another file"
        try:
            size = self._path.stat().st_size
        except OSError:  # in this very moment
            return f"{self._path} was deleted or moved"
        if size < self._size:
            return f"{self._path} was cut from {self._size} to {size} bytes"
        self._size = size
        return ""


def _known(path: Path) -> tuple[int, int] | None:
    """Device and number of a file; `None` without one."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino
