"""A session file as it is now, without changing it."""

from __future__ import annotations

import fcntl
import os
import sqlite3
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from rig.errors import SessionError


@dataclass(frozen=True, slots=True)
class Snapshot:
    """A session file.

    Attributes
    ----------
    path
        Where it is.
    data, log
        The file, and the ``-wal`` file beside it (empty without one).
    writer
        Process that has it open for writing, in words; empty without one.
    writable
        Whether this user may write it.
    complaints
        What SQLite has to say against it; empty when it is sound.
    """

    path: Path
    data: bytes
    log: bytes
    writer: str
    writable: bool
    complaints: tuple[str, ...]


def take_snapshot(path: str | os.PathLike[str]) -> Snapshot:
    """Read a session file and ask SQLite about a copy of it.

    Raises
    ------
    SessionError
        There is nothing that can be read.
    """
    place = Path(os.path.realpath(path))
    if place.is_dir():
        raise SessionError(f"{path} is a folder", "name a session file")
    writer = _writer(place)
    try:
        with TemporaryDirectory(prefix="rig-recover-") as folder:
            copy = Path(folder) / "copy"
            copy_log = copy.with_name("copy-wal")
            if writer:
                _copy_beside_writer(place, copy)
            else:
                copy.write_bytes(place.read_bytes())
                beside = place.with_name(place.name + "-wal")
                with suppress(FileNotFoundError):
                    copy_log.write_bytes(beside.read_bytes())
            data = copy.read_bytes()
            log = copy_log.read_bytes() if copy_log.exists() else b""
            complaints = _complaints(copy)
    except SessionError:
        raise
    except OSError as error:
        raise SessionError(
            f"cannot read {path}: {error.strerror or error}",
            "check its name and permissions, and that there is room for a copy in TMPDIR",
        ) from error
    return Snapshot(place, data, log, writer, os.access(place, os.W_OK), complaints)


def _writer(place: Path) -> str:
    """Ask the writer's lock, see `rig.session.lock`, without making one."""
    try:
        with place.with_name(place.name + ".lock").open("rb") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except BlockingIOError:
                owner = lock.read(32).decode("ascii", "replace").strip()
                return f"process {owner}" if owner else "another process"
    except OSError:
        return ""
    return ""


def _copy_beside_writer(place: Path, copy: Path) -> None:
    """Let SQLite copy it: bytes that change meanwhile would not fit together."""
    try:
        with (
            closing(sqlite3.connect(f"{place.as_uri()}?mode=ro", uri=True)) as source,
            closing(sqlite3.connect(copy)) as target,
        ):
            source.backup(target)
    except sqlite3.Error:
        copy.write_bytes(place.read_bytes())


def _complaints(copy: Path) -> tuple[str, ...]:
    try:
        with closing(sqlite3.connect(copy)) as connection:
            said = [str(row[0]) for row in connection.execute("PRAGMA integrity_check(20)")]
    except sqlite3.Error as error:
        return (str(error),)
    return () if said == ["ok"] else tuple(line for text in said for line in text.splitlines())
