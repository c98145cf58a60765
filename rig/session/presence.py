"""Whether the file at a path is still the one that is open: files are moved, synced and deleted."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from rig.files import identity_of


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
        self._files = {
            file: identity_of(file) for file in (path, path.with_name(path.name + "-wal"))
        }
        self._size = path.stat().st_size

    def remove_log(self) -> None:
        """Take away the log of a file that is elsewhere, once it is empty.

        SQLite leaves it, and would apply it to any other file that comes to this place.
        """
        log = self._path.with_name(self._path.name + "-wal")
        with suppress(OSError):
            if identity_of(log) == self._files[log] and log.stat().st_size == 0:
                log.unlink()
                self._path.with_name(self._path.name + "-shm").unlink()

    def trouble(self) -> str:
        """Say in words what has become of it; empty while it is there."""
        for path, before in self._files.items():
            identity = identity_of(path)
            if before is None:
                self._files[path] = identity
            elif identity is None:
                return f"{path} was deleted or moved"
            elif identity != before:
                return f"{path} was replaced by another file"
        try:
            size = self._path.stat().st_size
        except OSError:  # in this very moment
            return f"{self._path} was deleted or moved"
        if size < self._size:
            return f"{self._path} was cut from {self._size} to {size} bytes"
        self._size = size
        return ""
