"""Translation of errors with a session file into messages with a remedy."""

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rig.errors import RigError, SessionError
from rig.reasons import WORDINGS, rig_error

UNREADABLE = (sqlite3.Error, UnicodeDecodeError)
"""Errors raised by SQLite; the second for a damaged name whose bytes are not text."""
_SAME = {
    "sqlite_busy": "session_locked",
    "sqlite_locked": "session_locked",
    "sqlite_notadb": "not_a_session",
    "sqlite_perm": "sqlite_cantopen",
}
"""Codes of SQLite errors that have the message of another code."""
_OTHERS = {
    sqlite3.Error: "sqlite_failed",
    UnicodeDecodeError: "sqlite_corrupt",
    OSError: "session_unreadable",
    Exception: "sqlite_constraint",  # values that Python's sqlite3 refuses
}
"""Other errors, the most specific first."""


def as_session_error(path: Path, error: Exception) -> RigError:
    """Return the `SessionError` for an error of SQLite, the disk or a row, with its own message."""
    name = getattr(error, "sqlite_errorname", "")  # absent on errors of the Python wrapper
    primary = "_".join(name.lower().split("_")[:2])  # of SQLITE_IOERR_WRITE
    other = next(code for kind, code in _OTHERS.items() if isinstance(error, kind))
    code = _SAME.get(primary, primary if primary in WORDINGS else other)
    return rig_error(code, path=path, text=error)


@contextmanager
def translate_errors(path: Path) -> Iterator[None]:
    """Translate errors of SQLite, the disk or a row inside the block into `SessionError`."""
    try:
        yield
    except SessionError:
        raise
    except (*UNREADABLE, OSError) as error:
        raise as_session_error(path, error) from error
