"""Texts by key in the user's cache folder, a file each, and never beside a record.

Nothing rests on it: what cannot be read, written or trusted is as if it were not there. A file
takes its place whole, so several processes may use the cache at once, and what a killed process
began is no entry.
"""

import os
import shutil
import zlib
from contextlib import suppress
from hashlib import sha256
from pathlib import Path

import platformdirs

_MOST_BYTES = 512 << 20
"""A session of 108 runs takes 2 MB of it; a single entry may take a sixteenth."""
_PARTS = 16
"""Folders that share it, by a key's first digit: for room in one, no other is looked through."""


class CacheFolder:
    """The cache of this user, or one in another folder.

    Parameters
    ----------
    folder
        Made when it is first used, for this user alone; by default where the platform has caches.
    most_bytes
        What its files may take; where an entry has no more room, a part of the others is forgotten.
    """

    def __init__(self, folder: Path | None = None, most_bytes: int = _MOST_BYTES) -> None:
        self.folder = platformdirs.user_cache_path("chainrig") if folder is None else folder
        self._most_bytes = most_bytes // _PARTS  # in each of them

    def get(self, key: str) -> str | None:
        """Return the text of a key; `None` where there is none."""
        # What was altered, or written by halves, fails the checksum of its compression.
        with suppress(OSError, ValueError, zlib.error):
            return zlib.decompress(self._file(key).read_bytes()).decode("utf-8", "surrogatepass")
        return None

    def put(self, key: str, text: str) -> None:
        """Keep a text, if that is possible."""
        packed = zlib.compress(text.encode("utf-8", "surrogatepass"), 1)
        if len(packed) > self._most_bytes:
            return
        with suppress(OSError):
            file = self._file(key)
            file.parent.mkdir(exist_ok=True)
            with os.scandir(file.parent) as beside:
                # What another process has only begun may be renamed meanwhile.
                used = sum(entry.stat().st_size for entry in beside if "." not in entry.name)
            if used + len(packed) > self._most_bytes:
                shutil.rmtree(file.parent)
                file.parent.mkdir()
            begun = file.with_suffix(f".{os.getpid()}")
            try:
                begun.write_bytes(packed)
                begun.replace(file)
            finally:  # a full disk gets its room back
                begun.unlink(missing_ok=True)

    def sizes(self) -> list[int] | None:
        """Return how many bytes each entry takes; `None` where no cache can be used."""
        with suppress(OSError):
            return [file.stat().st_size for file in self._kept_files()]
        return None

    def clear(self) -> None:
        """Forget everything; other files of the folder, such as a daemon's socket, stay."""
        with suppress(OSError):
            for file in self._kept_files():
                file.unlink(missing_ok=True)

    def _kept_files(self) -> list[Path]:
        """Return all files of results, with the database in which an earlier version kept them."""
        folder = self._private_folder()
        return [*folder.glob("[0-9a-f]/*"), *folder.glob("results.sqlite*")]

    def _file(self, key: str) -> Path:
        name = sha256(key.encode()).hexdigest()
        return self._private_folder() / name[0] / name

    def _private_folder(self) -> Path:
        """Return the folder, made where it was missing.

        Raises
        ------
        OSError
            It cannot be made, or others can write in it.
        """
        if not self.folder.is_absolute():
            raise FileNotFoundError(self.folder)
        self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        about = self.folder.stat()
        if hasattr(os, "getuid") and (about.st_uid != os.getuid() or about.st_mode & 0o022):
            raise PermissionError(self.folder)
        return self.folder
