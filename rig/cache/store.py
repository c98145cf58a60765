"""One SQLite file of texts by key in the user's cache folder, and never beside a record.

Nothing rests on it: where it cannot be read, written or trusted it is as if it were empty. SQLite
lets several processes use it at once, and an entry that a killed process began is not there.
"""

from __future__ import annotations

import os
import sqlite3
import stat
import zlib
from collections.abc import Callable
from contextlib import closing, suppress
from pathlib import Path
from typing import NamedTuple, TypeVar

import platformdirs

Answer = TypeVar("Answer")

_MOST_BYTES = 256 << 20
"""A session of 108 runs takes 2 MB of it."""
_BUSY_S = 1.0
_UNUSABLE = {
    sqlite3.SQLITE_CORRUPT,
    sqlite3.SQLITE_NOTADB,
    sqlite3.SQLITE_ERROR,
    sqlite3.SQLITE_FULL,
}
"""What SQLite says of a file that is damaged, that has other tables than these, or that is full."""
_CREATE = "CREATE TABLE IF NOT EXISTS entry (key TEXT PRIMARY KEY, packed BLOB NOT NULL) STRICT"


class CacheSize(NamedTuple):
    """How many entries there are, and how many bytes they take."""

    entries: int
    used_bytes: int


class CacheFile:
    """The cache of this user, or one in another folder.

    Parameters
    ----------
    folder
        Made when it is first used, for this user alone; by default where the platform has caches.
    most_bytes
        What the file may take; where an entry has no more room, all others are forgotten for it.
    """

    def __init__(self, folder: Path | None = None, most_bytes: int = _MOST_BYTES) -> None:
        self.folder = platformdirs.user_cache_path("chainrig") if folder is None else folder
        self._path = self.folder / "results.sqlite"
        self._most_bytes = most_bytes

    def get(self, key: str) -> str | None:
        """Return the text of a key; `None` where there is none."""

        def read(connection: sqlite3.Connection) -> str | None:
            row = connection.execute("SELECT packed FROM entry WHERE key = ?", [key]).fetchone()
            # What was altered fails the checksum of its compression.
            return row and zlib.decompress(row[0]).decode("utf-8", "surrogatepass")

        return self._transact(read)

    def put(self, key: str, text: str) -> None:
        """Keep a text, if that is possible."""
        packed = zlib.compress(text.encode("utf-8", "surrogatepass"), 1)
        insert = "INSERT OR REPLACE INTO entry VALUES (?, ?)"
        self._transact(lambda connection: connection.execute(insert, (key, packed)))

    def size(self) -> CacheSize | None:
        """Return how much is kept; `None` where no cache can be used."""

        def count(connection: sqlite3.Connection) -> CacheSize:
            rows = "SELECT count(*), coalesce(sum(length(packed)), 0) FROM entry"
            return CacheSize(*connection.execute(rows).fetchone())

        return self._transact(count)

    def clear(self) -> None:
        """Forget everything."""
        with suppress(OSError):
            self._path.unlink()
            self._path.with_name(f"{self._path.name}-journal").unlink()

    def _transact(self, use: Callable[[sqlite3.Connection], Answer]) -> Answer | None:
        """Use the file in one transaction; begin a new file where it is damaged."""
        for _ in range(2):
            try:
                self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
                if not _is_private(self.folder):
                    return None
                connection = sqlite3.connect(self._path, timeout=_BUSY_S)
                with closing(connection), connection:
                    # A crash of the computer may lose the file; that of a program loses nothing.
                    connection.execute("PRAGMA synchronous = OFF")
                    connection.execute(_CREATE)
                    (page_bytes,) = connection.execute("PRAGMA page_size").fetchone()
                    pages = self._most_bytes // page_bytes
                    connection.execute(f"PRAGMA max_page_count = {pages}")
                    return use(connection)
            except sqlite3.Error as error:
                # Else another process has it for long, or there is no room.
                if error.sqlite_errorcode & 0xFF not in _UNUSABLE:
                    return None
                self.clear()
            except (OSError, ValueError, zlib.error):
                return None
        return None


def _is_private(folder: Path) -> bool:
    """Whether nobody else can write in a folder."""
    about = folder.stat()
    if not folder.is_absolute() or not stat.S_ISDIR(about.st_mode):
        return False
    return not hasattr(os, "getuid") or (about.st_uid == os.getuid() and not about.st_mode & 0o022)
