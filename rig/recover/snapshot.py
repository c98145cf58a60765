"""A session file as it is now, without changing it."""

from __future__ import annotations

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
    trouble
        Why SQLite, or this program, cannot read it; empty when both can.
    """

    path: Path
    data: bytes
    logged: int | None
    writer: str
    writable: bool
    trouble: str


def take_snapshot(path: str | Path) -> SessionCopy:
    """Read a session file and ask SQLite about a copy of it.

    Raises
    ------
    SessionError
        There is nothing that can be read.
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
    """Let SQLite copy it: bytes that change meanwhile would not fit together."""
    try:
        with closing(open_database(place, "ro")) as source, closing(sqlite3.connect(copy)) as new:
            source.backup(new)
    except UNREADABLE:
        copy.write_bytes(place.read_bytes())


def _fold_in(copy: Path) -> int:
    """Let SQLite bring its log into the copy, up to the last whole commit; count its pages."""
    try:
        with closing(sqlite3.connect(copy)) as connection:
            connection.execute("PRAGMA writable_schema = on")  # also into one that is damaged
            _, logged, _ = connection.execute("PRAGMA wal_checkpoint").fetchone()
    except UNREADABLE:
        return 0
    return max(0, int(logged))


def _trouble(copy: Path, name: str) -> str:
    """Say what SQLite, or this program, has against a copy; empty when both can read it."""
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
