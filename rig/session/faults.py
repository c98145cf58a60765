"""SQLite's errors in the user's words, each with what to do next."""

from __future__ import annotations

import sqlite3
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rig.errors import SessionError
from rig.session.foreign import RECOVER

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

_NOT_A_SESSION = "name a file made by rig run, rig import or rig daemon"
_LOCKED = (
    "{path} is locked by another program",
    "close the program that has the session open and try again",
)
_ADVICE = {
    sqlite3.SQLITE_FULL: (
        "the disk is full while writing {path}",
        "free some space, then the same command goes on: nothing committed is lost, and a drop "
        "that fell is still on the board",
    ),
    sqlite3.SQLITE_IOERR: (
        "the disk failed under {path}",
        "check the disk and its cable, copy the session to another one, then open the copy",
    ),
    sqlite3.SQLITE_READONLY: (
        "{path} cannot be written",
        "check the permissions of the file and its folder, or work on a copy",
    ),
    sqlite3.SQLITE_PERM: ("{path} may not be opened", "check the permissions of the file"),
    sqlite3.SQLITE_CANTOPEN: (
        "{path} cannot be opened",
        "check the permissions of the file and its folder",
    ),
    sqlite3.SQLITE_BUSY: _LOCKED,
    sqlite3.SQLITE_LOCKED: _LOCKED,
    sqlite3.SQLITE_CORRUPT: ("{path} is damaged", RECOVER),
    sqlite3.SQLITE_INTERRUPT: (
        "{path} takes far longer to read than any session",
        "it was altered or is damaged: rig recover says what is whole",
    ),
    sqlite3.SQLITE_NOTADB: ("{path} is not a session file", _NOT_A_SESSION),
    sqlite3.SQLITE_CONSTRAINT: (
        "{path} refuses this record",
        "raw records are added once and never altered; record a new attempt instead",
    ),
}


def not_a_session(path: Path, why: str) -> SessionError:
    """Error for a file that is something else."""
    return SessionError(f"{path} is not a session file: {why}", _NOT_A_SESSION)


def as_session_error(path: Path, error: sqlite3.Error) -> SessionError:
    """Translate one SQLite error; the original words are kept in brackets."""
    code = getattr(error, "sqlite_errorcode", None)  # absent on errors of the Python wrapper
    primary = code & 0xFF if isinstance(code, int) else sqlite3.SQLITE_ERROR
    message, hint = _ADVICE.get(primary, ("{path} cannot be read", RECOVER))
    return SessionError(f"{message.format(path=path)} ({error})", hint)


@contextmanager
def translated(path: Path) -> Iterator[None]:
    """Raise SQLite's errors inside the block as `SessionError`."""
    try:
        yield
    except sqlite3.Error as error:
        raise as_session_error(path, error) from error
    except UnicodeDecodeError as error:  # SQLite names what is damaged by bytes that are no text
        raise SessionError(f"{path} is damaged", RECOVER) from error
