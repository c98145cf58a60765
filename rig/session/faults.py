"""What is wrong with a session file in the user's words, each with what to do next."""

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
_OTHERS = {
    sqlite3.Error: "sqlite_failed",
    UnicodeDecodeError: "sqlite_corrupt",
    OSError: "session_unreadable",
    Exception: "sqlite_constraint",  # what Python does not put into a row
}
"""What else there is, the narrower first."""


def as_session_error(path: Path, error: Exception) -> SessionError:
    """Translate an error of SQLite, of the disk or of a row; its own words are kept."""
    name = getattr(error, "sqlite_errorname", "")  # absent on errors of the Python wrapper
    primary = "_".join(name.lower().split("_")[:2])  # of SQLITE_IOERR_WRITE
    other = next(code for kind, code in _OTHERS.items() if isinstance(error, kind))
    code = _SAME.get(primary, primary if primary in WORDINGS else other)
    return make_error(SessionError, code, path=path, text=error)


@contextmanager
def translate_errors(path: Path) -> Iterator[None]:
    """Raise what makes a session unreadable inside the block as `SessionError`."""
    try:
        yield
    except SessionError:
        raise
    except (*UNREADABLE, OSError) as error:
        raise as_session_error(path, error) from error
