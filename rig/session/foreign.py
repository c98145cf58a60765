"""A file that somebody sent is opened as foreign input: nothing in it runs, and nothing runs away.

SQLite would expand a view that stands in a table's place, run what a trigger says, and compute a
column that is defined by an expression. So the schema is compared with the known one before the
first row is read.
"""

from __future__ import annotations

import sqlite3
from contextlib import closing
from functools import cache
from typing import TYPE_CHECKING, TypeAlias

from rig.errors import SessionError
from rig.reasons import make_error
from rig.session.schema import CREATE, LATER

if TYPE_CHECKING:
    from pathlib import Path

    Shape: TypeAlias = tuple[object, ...]

LONGEST_VALUE = 1 << 26
"""Bytes of one value; the longest that is ever written is a protocol or a burst of edges."""
_STEPS = 1 << 20  # of SQLite's machine, between two looks at how many there were
_MOST_STEPS = 1 << 31
"""Of one statement: reading a session of a day takes a hundredth."""
_OF_ANALYZE = {"sqlite_stat1", "sqlite_stat4"}  # left behind by somebody's ANALYZE


def guard(connection: sqlite3.Connection) -> None:
    """Bound what one value may cost, whatever the file says of its length."""
    # Not `trusted_schema = OFF`: SQLite then refuses the json_valid of our own tables, and once
    # `check_schema` has been through there is nothing else in the file that could run.
    connection.execute("PRAGMA cell_size_check = ON")
    connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, LONGEST_VALUE)


def limit_steps(connection: sqlite3.Connection) -> None:
    """Have statements end that take far more steps, from now on, than any session needs."""
    left = _MOST_STEPS

    def step() -> bool:
        nonlocal left
        left -= _STEPS
        return left < 0

    connection.set_progress_handler(step, _STEPS)


def check_schema(path: Path, connection: sqlite3.Connection, version: int) -> None:
    """Compare a file's tables, indices and triggers with those that this program makes.

    Raises
    ------
    SessionError
        It has others, or they are built in another way.
    """
    found, known = _schema(connection), _known()
    for name, shape in known.items():
        columns, since = LATER.get(name, ((), 1))
        if version < since:
            continue
        wanted = shape
        if columns:  # only these are missing before
            missing = sum(version < at for at in columns)
            wanted = shape[: len(shape) - missing]
        if found.pop(name, None) != wanted:
            raise _altered(path, f"{name} is missing or not as rig makes it")
    if strange := sorted(found.keys() - _OF_ANALYZE):
        raise _altered(path, f"it has {strange[0]}, which rig does not make")


def _altered(path: Path, what: str) -> SessionError:
    return make_error(SessionError, "session_altered", path=path, text=what)


@cache
def _known() -> dict[str, Shape]:
    with closing(sqlite3.connect(":memory:")) as connection:
        connection.executescript(CREATE)
        return _schema(connection)


def _schema(connection: sqlite3.Connection) -> dict[str, Shape]:
    """Give by name what there is: tables with their columns, all else as it is written."""
    kinds = {name: tuple(how) for _, name, *how in connection.execute("PRAGMA table_list")}
    found: dict[str, Shape] = {}
    for kind, name, of, sql in connection.execute(
        "SELECT type, name, tbl_name, sql FROM main.sqlite_master"
    ):
        if kind == "table":
            columns = connection.execute("SELECT * FROM pragma_table_xinfo(?)", (name,))
            table_kind, _, *how = kinds.get(name, ("", 0))
            found[name] = (kind, table_kind, *how, *columns)
        else:
            found[name] = (kind, of, " ".join((sql or "").split()))
    return found
