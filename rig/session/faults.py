"""SQLite's errors in the user's words, each with what to do next."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rig.errors import SessionError
from rig.reasons import make_error
from rig.wordings import WORDINGS

UNREADABLE = (sqlite3.Error, UnicodeDecodeError)
"""What SQLite raises; where it names what is damaged by bytes that are no text, the second."""
_SAME = {
    "sqlite_busy": "session_locked",
    "sqlite_locked": "session_locked",
    "sqlite_notadb": "not_a_session",
    "sqlite_perm": "sqlite_cantopen",
}
"""Errors of SQLite about which there is no more to say than another code does."""


def not_a_session(path: Path, why: str) -> SessionError:
    """Error for a file that is something else."""
    return make_error(SessionError, "not_a_session", path=path, text=why)


def as_session_error(path: Path, error: Exception) -> SessionError:
    """Translate an error of SQLite or of a row that Python refuses; its own words are kept."""
    name = getattr(error, "sqlite_errorname", "")  # absent on errors of the Python wrapper
    if not isinstance(error, sqlite3.Error):
        name = "sqlite_corrupt" if isinstance(error, UNREADABLE) else "sqlite_constraint"
    primary = "_".join(name.lower().split("_")[:2])  # of SQLITE_IOERR_WRITE
    code = _SAME.get(primary, primary if primary in WORDINGS else "sqlite_failed")
    return make_error(SessionError, code, path=path, text=error)


@contextmanager
def translate_errors(path: Path) -> Iterator[None]:
    """Raise SQLite's errors inside the block as `SessionError`."""
    try:
        yield
    except UNREADABLE as error:
        raise as_session_error(path, error) from error
