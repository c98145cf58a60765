"""Snapshot of a session file, without changing it."""

import os
import sqlite3
from contextlib import closing
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from rig.errors import SessionError
from rig.files import require_file
from rig.session.database import copy_session, open_database
from rig.session.faults import UNREADABLE, translate_errors
from rig.session.lock import writer_of
from rig.session.store import Session


class SessionCopy(NamedTuple):
    """Content and state of a session file.

    Attributes
    ----------
    path
        Path of the file.
    data
        Content of the file, merged with its log (``-wal``).
    logged
        Number of pages of the log; `None` without a log.
    writer
        Name of the process that writes the file; empty without a writer.
    writable
        Whether this user may write it.
    trouble
        Why SQLite, or this program, cannot read it; empty if both can.
    """

    path: Path
    data: bytes
    logged: int | None
    writer: str
    writable: bool
    trouble: str


def take_snapshot(path: str | Path) -> SessionCopy:
    """Return the content of a session file, and test a copy of it with SQLite.

    Raises
    ------
    SessionError
        The file cannot be read.
    """
    place = Path(os.path.realpath(path))
    writer, logged = writer_of(place), None
    with translate_errors(Path(path)), TemporaryDirectory(prefix="rig-recover-") as folder:
        require_file(place)
        copy = Path(folder) / "copy"
        if writer:
            _copy_beside_writer(place, copy)
        else:
            copy_session(place, Path(folder))
            if copy.with_name("copy-wal").exists():
                logged = _fold_in(copy)
        data, trouble = copy.read_bytes(), _trouble(copy, place.name)
    return SessionCopy(place, data, logged, writer, os.access(place, os.W_OK), trouble)


def _copy_beside_writer(place: Path, copy: Path) -> None:
    """Copy a file with SQLite, as a plain copy beside a writer may be inconsistent."""
    try:
        with closing(open_database(place, "ro")) as source, closing(sqlite3.connect(copy)) as new:
            source.backup(new)
    except UNREADABLE:
        copy.write_bytes(place.read_bytes())


def _fold_in(copy: Path) -> int:
    """Merge the log into the copy, up to the last complete commit; return its number of pages."""
    try:
        with closing(sqlite3.connect(copy)) as connection:
            connection.execute("PRAGMA writable_schema = on")  # also into one that is damaged
            _, logged, _ = connection.execute("PRAGMA wal_checkpoint").fetchone()
    except UNREADABLE:
        return 0
    return max(0, int(logged))


def _trouble(copy: Path, name: str) -> str:
    """Return why SQLite, or this program, cannot read a copy; empty if both can."""
    try:
        with closing(sqlite3.connect(copy)) as connection:
            complaints = [str(text) for (text,) in connection.execute("PRAGMA integrity_check(20)")]
        if complaints != ["ok"]:
            return f"SQLite cannot read it as it is: {complaints[0].splitlines()[0]}"
        with Session.open(copy, readonly=True) as session:
            session.check()
    except UNREADABLE as error:
        return f"SQLite cannot read it as it is: {error}"
    except SessionError as error:
        return f"rig cannot read it as it is: {error.message.replace(str(copy), name)}"
    return ""
