"""Whether the file at a path is still the one that is open: files are moved, synced and deleted."""

from __future__ import annotations

import os
from contextlib import suppress
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
        self._path, self._log = path, path.with_name(path.name + "-wal")
        self._known = {file: _stat(file) for file in (path, self._log)}

    def remove_log(self) -> None:
        """Take away the log of a file that is elsewhere, once it is empty.

        SQLite leaves it, and would apply it to any other file that comes to this place.
        """
        known, now = self._known[self._log], _stat(self._log)
        if known and now and os.path.samestat(known, now) and now.st_size == 0:
            with suppress(OSError):
                self._log.unlink()
                self._path.with_name(self._path.name + "-shm").unlink()

    def trouble(self) -> str:
        """Say in words what has become of it; empty while it is there."""
        for path, before in self._known.items():
            now = _stat(path)
            if before is not None:
                if now is None:
                    return f"{path} was deleted or moved"
                if not os.path.samestat(now, before):
                    return f"{path} was replaced by another file"
                if path == self._path and now.st_size < before.st_size:
                    return f"{path} was cut from {before.st_size} to {now.st_size} bytes"
            self._known[path] = now
        return ""


def _stat(path: Path) -> os.stat_result | None:
    with suppress(OSError):
        return path.stat()
    return None
