"""Creation and opening of a session's SQLite file, with checks for foreign files."""

import os
import shutil
import sqlite3
from contextlib import ExitStack, closing
from pathlib import Path
from tempfile import TemporaryDirectory

from rig.errors import InputError
from rig.files import beside, replacing, require_file
from rig.reasons import errors_become, rig_error
from rig.session.faults import translate_errors
from rig.session.foreign import check_schema
from rig.session.hashes import extend_chain
from rig.session.lock import writer_of
from rig.session.schema import SCHEMA_VERSION, TABLES, Record, create_script, upgrade_script

_GUARDS = "PRAGMA foreign_keys = ON; PRAGMA recursive_triggers = ON;"
_READING = f"{_GUARDS} PRAGMA query_only = ON;"
# macOS: fsync alone leaves data in the drive's cache.
_DURABLE = "PRAGMA synchronous = FULL; PRAGMA fullfsync = ON; PRAGMA checkpoint_fullfsync = ON;"
_WRITING = f"{_GUARDS} PRAGMA journal_mode = WAL; {_DURABLE}"
_BUSY_S = 2.0  # only another program can lock the database for longer


def build(path: Path, first: Record) -> None:
    """Create a new session file, completely or not at all.

    Parameters
    ----------
    path
        Path without a file; the caller holds its lock.
    first
        The first rows, by table.

    Raises
    ------
    SessionError
        The path exists, or cannot be written.
    """
    if path.exists():
        raise rig_error("session_there", path=path)
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as memory:
        memory.executescript(f"BEGIN;\n{create_script()}COMMIT;")
        for table, rows in first.items():
            memory.executemany(TABLES[table].insert, rows)
        extend_chain(memory)
        content = memory.serialize()
    try:
        with replacing(path) as stream:
            stream.write(content)
    except InputError as error:
        raise rig_error("session_unmade", path=path, text=error.__cause__ or error) from error


def check_place(path: Path) -> None:
    """Raise an error for a path that cannot be a session, before SQLite opens it.

    Raises
    ------
    SessionError
        The file is missing, empty, or not a regular file.
    """
    with errors_become("session_absent", OSError, path=path):
        require_file(path)
        size = path.stat().st_size
    if size == 0:  # SQLite would take it for an empty database
        raise rig_error("not_a_session", path=path, text="it is empty")


def connect(path: Path, *, readonly: bool) -> sqlite3.Connection:
    """Open an existing session file and check that it is one.

    Raises
    ------
    SessionError
        It is not a session, newer than this program, damaged or not permitted.
    """
    # Never read the header directly: closing a second handle on the file would drop the POSIX
    # locks of a writer in this process.
    with translate_errors(path), ExitStack() as undo:
        connection = _reading(path) if readonly else open_database(path, "rw")
        undo.callback(connection.close)
        version = check_schema(path, connection)
        connection.executescript(_READING if readonly else _WRITING)
        for newer in range(SCHEMA_VERSION if readonly else version, SCHEMA_VERSION):
            connection.executescript(upgrade_script(newer + 1))
        undo.pop_all()
    return connection


def open_database(path: Path, mode: str) -> sqlite3.Connection:
    """Open a file with SQLite, without any checks."""
    uri = f"{path.as_uri()}?mode={mode}"
    return sqlite3.connect(uri, uri=True, timeout=_BUSY_S, isolation_level=None)


def copy_session(path: Path, folder: Path) -> Path:
    """Copy a session without a writer, with the log (``-wal``) beside it.

    Raises
    ------
    OSError
        It cannot be read, or there is no room for it.
    """
    copy = shutil.copyfile(path, folder / "copy")
    log = beside(path, "-wal")
    if log.is_file() and log.stat().st_size:
        shutil.copyfile(log, folder / "copy-wal")
    return copy


def _reading(path: Path) -> sqlite3.Connection:
    """Open a session read-only, without changes to its file and the files beside it."""
    # SQLite would merge the log of a dead writer into the file on close.
    leftover = any(beside(path, end).exists() for end in ("-wal", "-shm"))
    if leftover and not writer_of(path):
        memory = sqlite3.connect(":memory:", isolation_level=None)
        with TemporaryDirectory(prefix="rig-session-") as folder:
            copy = copy_session(path, Path(folder))
            with closing(open_database(copy, "rw")) as source:
                source.backup(memory)
        if not writer_of(path):  # otherwise the copy may be in the middle of a write
            return memory
        memory.close()
    # WAL keeps a log and shared memory beside the database. A read-only handle would create them
    # and could not remove them again, so where writing is allowed the guard is query_only.
    if os.access(path, os.W_OK) and os.access(path.parent, os.W_OK):
        return open_database(path, "rw")
    # Without a log there is no writer: on a CD or a write-protected share the file may be read
    # as it is.
    logged = beside(path, "-wal").exists()
    return open_database(path, "ro" if logged else "ro&immutable=1")
