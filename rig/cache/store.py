"""One SQLite file of texts by key in the user's cache folder, and never beside a record.

Nothing rests on it: where it cannot be read, written or trusted it is as if it were empty. SQLite
lets several processes use it at once, and an entry that a killed process began is not there.
"""

from __future__ import annotations

import os
import sqlite3
import stat
import time
import zlib
from contextlib import closing, suppress
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import platformdirs

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

Answer = TypeVar("Answer")

_MOST_BYTES = 256 << 20
"""A session of 108 runs takes 2 MB of it."""
_BUSY_S = 1.0
_DAY_S = 86_400
"""How exactly it is known when an entry was last used, so that to read is rarely to write."""
_UNUSABLE = {sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_ERROR}
"""What SQLite says of a file that is damaged, or that has other tables than these."""
_CREATE = """
CREATE TABLE IF NOT EXISTS entry (
    key TEXT PRIMARY KEY, used_s INTEGER NOT NULL, crc32 INTEGER NOT NULL, packed BLOB NOT NULL
) STRICT;
CREATE INDEX IF NOT EXISTS by_use ON entry (used_s);
"""


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
        What all entries may take; those that were not used for longest go first.
    """

    def __init__(self, folder: Path | None = None, most_bytes: int = _MOST_BYTES) -> None:
        self.folder = platformdirs.user_cache_path("chainrig") if folder is None else folder
        self._path = self.folder / "results.sqlite"
        self._most_bytes = most_bytes

    def get(self, key: str) -> str | None:
        """Return the text of a key; `None` where there is none."""
        return self._transact(lambda connection: _read(connection, key))

    def put(self, key: str, text: str) -> None:
        """Keep a text, if that is possible."""
        packed = zlib.compress(text.encode("utf-8", "surrogatepass"), 1)
        self._transact(lambda connection: self._write(connection, key, packed))

    def size(self) -> CacheSize | None:
        """Return how much is kept; `None` where no cache can be used."""

        def count(connection: sqlite3.Connection) -> CacheSize:
            (entries,) = connection.execute("SELECT count(*) FROM entry").fetchone()
            return CacheSize(entries, _used_bytes(connection))

        return self._transact(count)

    def clear(self) -> None:
        """Forget everything."""
        with suppress(OSError):
            self._path.unlink()
            self._path.with_name(f"{self._path.name}-journal").unlink()

    def _write(self, connection: sqlite3.Connection, key: str, packed: bytes) -> None:
        row = (key, int(time.time()), _checksum(key, packed), packed)
        connection.execute("INSERT OR REPLACE INTO entry VALUES (?, ?, ?, ?)", row)
        oldest = "SELECT key FROM entry ORDER BY used_s, rowid LIMIT 16"
        while _used_bytes(connection) > self._most_bytes:
            if not connection.execute(f"DELETE FROM entry WHERE key IN ({oldest})").rowcount:  # noqa: S608
                break

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
                    connection.executescript(_CREATE)
                    return use(connection)
            except sqlite3.Error as error:
                # Else another process has it for long, or there is no room.
                if error.sqlite_errorcode & 0xFF not in _UNUSABLE:
                    return None
                self.clear()
            except OSError:
                return None
        return None


def _is_private(folder: Path) -> bool:
    """Whether nobody else can write in a folder."""
    about = folder.stat()
    if not folder.is_absolute() or not stat.S_ISDIR(about.st_mode):
        return False
    return os.name != "posix" or (about.st_uid == os.getuid() and not about.st_mode & 0o022)


def _read(connection: sqlite3.Connection, key: str) -> str | None:
    rows = connection.execute("SELECT used_s, crc32, packed FROM entry WHERE key = ?", [key])
    used_s, crc32, packed = rows.fetchone() or (0, 0, b"")
    if not packed or crc32 != _checksum(key, packed):
        return None
    now_s = int(time.time())
    if abs(now_s - used_s) > _DAY_S:
        connection.execute("UPDATE entry SET used_s = ? WHERE key = ?", [now_s, key])
    return zlib.decompress(packed).decode("utf-8", "surrogatepass")


def _checksum(key: str, packed: bytes) -> int:
    return zlib.crc32(packed, zlib.crc32(key.encode()))


def _used_bytes(connection: sqlite3.Connection) -> int:
    numbers = ("page_count", "freelist_count", "page_size")
    pages, free, size = (connection.execute(f"PRAGMA {n}").fetchone()[0] for n in numbers)
    return int((pages - free) * size)
