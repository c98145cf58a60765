"""Check that the file at a path is still the open file, not moved, replaced or deleted."""

import os
from contextlib import suppress
from pathlib import Path

from rig.files import beside, stat_of


class Presence:
    """Identity and size of a session's file when it was opened.

    SQLite continues with a file that has been deleted, and later commits are lost. A session only
    grows, so a smaller file has been cut.

    Parameters
    ----------
    path
        The session, open; its log (``-wal``) beside it.
    """

    def __init__(self, path: Path) -> None:
        self._path, self._log = path, beside(path, "-wal")
        self._known = {file: stat_of(file) for file in (path, self._log)}

    def remove_log(self) -> None:
        """Remove the empty log of a file that has moved.

        SQLite leaves the log, and would apply it to any other file at this path.
        """
        known, now = self._known[self._log], stat_of(self._log)
        if known and now and os.path.samestat(known, now) and now.st_size == 0:
            with suppress(OSError):
                self._log.unlink()
                beside(self._path, "-shm").unlink()

    def trouble(self) -> str:
        """Return in words what happened to the file; empty if it is unchanged."""
        for path, before in self._known.items():
            now = stat_of(path)
            if before is not None:
                if now is None:
                    return f"{path} was deleted or moved"
                if not os.path.samestat(now, before):
                    return f"{path} was replaced by another file"
                if path == self._path and now.st_size < before.st_size:
                    return f"{path} was cut from {before.st_size} to {now.st_size} bytes"
            self._known[path] = now
        return ""
