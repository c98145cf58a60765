"""A session file as it is now, without changing it."""

from __future__ import annotations

import os
import sqlite3
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from rig.errors import SessionError
from rig.files import require_file
from rig.session.database import copy_session
from rig.session.lock import writer_of
from rig.session.store import Session

_TROUBLE = (sqlite3.Error, UnicodeDecodeError)
"""What SQLite raises; where it names what is damaged by bytes that are no text, the second."""


@dataclass(frozen=True, slots=True)
class SessionCopy:
    """A session file.

    Attributes
    ----------
    path
        Where it is.
    data
        The file, with all that the ``-wal`` file beside it has to add to it.
    logged
        How many pages that has; `None` without it.
    writer
        Process that has it open for writing, in words; empty without one.
    writable
        Whether this user may write it.
    complaints
        What SQLite has to say against it; empty when it is sound.
    unreadable
        Why this program cannot read it all the same; empty when it can.
    """

    path: Path
    data: bytes
    logged: int | None
    writer: str
    writable: bool
    complaints: tuple[str, ...]
    unreadable: str


def take_snapshot(path: str | os.PathLike[str]) -> SessionCopy:
    """Read a session file and ask SQLite about a copy of it.

    Raises
    ------
    SessionError
        There is nothing that can be read.
    """
    place = Path(os.path.realpath(path))
    writer, logged = writer_of(place), None
    try:
        require_file(place)
        with TemporaryDirectory(prefix="rig-recover-") as folder:
            copy = Path(folder) / "copy"
            if writer:
                _copy_beside_writer(place, copy)
            else:
                copy_session(place, Path(folder))
                if copy.with_name("copy-wal").exists():
                    logged = _fold_in(copy)
            data = copy.read_bytes()
            complaints = _complaints(copy)
            unreadable = "" if complaints else _unreadable(copy, place)
    except SessionError:
        raise
    except OSError as error:
        raise SessionError(
            f"cannot read {path}: {error.strerror or error}",
            "check its name and permissions, and that there is room for a copy in TMPDIR",
        ) from error
    return SessionCopy(
        place, data, logged, writer, os.access(place, os.W_OK), complaints, unreadable
    )


def _copy_beside_writer(place: Path, copy: Path) -> None:
    """Let SQLite copy it: bytes that change meanwhile would not fit together."""
    try:
        with (
            closing(sqlite3.connect(f"{place.as_uri()}?mode=ro", uri=True)) as source,
            closing(sqlite3.connect(copy)) as target,
        ):
            source.backup(target)
    except _TROUBLE:
        copy.write_bytes(place.read_bytes())


def _fold_in(copy: Path) -> int:
    """Let SQLite bring its log into the copy, up to the last whole commit; count its pages."""
    try:
        with closing(sqlite3.connect(copy)) as connection:
            connection.execute("PRAGMA writable_schema = on")  # also into one that is damaged
            _, logged, _ = connection.execute("PRAGMA wal_checkpoint").fetchone()
    except _TROUBLE:
        return 0
    return max(0, int(logged))


def _complaints(copy: Path) -> tuple[str, ...]:
    try:
        with closing(sqlite3.connect(copy)) as connection:
            said = [str(row[0]) for row in connection.execute("PRAGMA integrity_check(20)")]
    except _TROUBLE as error:
        return (str(error),)
    if said != ["ok"]:
        return tuple(line for text in said for line in text.splitlines())
    return ()


def _unreadable(copy: Path, place: Path) -> str:
    """Say why `rig report` cannot read a file that is sound for SQLite; empty when it can."""
    try:
        with Session.open(copy, readonly=True) as session:
            session.check()
    except SessionError as error:
        return error.message.replace(str(copy), place.name)
    return ""
