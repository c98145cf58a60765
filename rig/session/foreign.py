"""Protection against foreign session files: no code of the file runs, and cost is bounded.

SQLite would expand a view in place of a table, run triggers, and compute generated columns. So the
schema is compared with the known schema before the first row is read.
"""

import sqlite3
from contextlib import closing
from functools import cache
from itertools import repeat
from pathlib import Path

from rig.reasons import rig_error
from rig.session.schema import APPLICATION_ID, SCHEMA_VERSION, Row, create_script

LONGEST_VALUE = 1 << 26
"""Most bytes of a value; the longest ever written is a protocol or a burst of edges."""
_STEPS = 1 << 20  # steps of SQLite's virtual machine between two checks
_MOST_STEPS = 1 << 31
"""Most steps of a statement: reading a session of a day takes a hundredth."""
_OF_ANALYZE = {"sqlite_stat1", "sqlite_stat4"}  # created by the statement ANALYZE


def limit_steps(connection: sqlite3.Connection) -> None:
    """Abort statements of this connection that take far more steps than any session needs."""
    looks = repeat(False, _MOST_STEPS // _STEPS)
    connection.set_progress_handler(lambda: next(looks, True), _STEPS)


def check_schema(path: Path, connection: sqlite3.Connection) -> int:
    """Compare a file's tables, indices and triggers with those of this program.

    This also limits the size of values for this connection, whatever length the file claims.

    Returns
    -------
    int
        The version of its format.

    Raises
    ------
    SessionError
        It is not a session, or newer than this program, or its tables differ.
    """
    # Not `trusted_schema = OFF`: SQLite then refuses the json_valid of our own tables. After the
    # comparison, the file has no other code.
    connection.execute("PRAGMA cell_size_check = ON")
    connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, LONGEST_VALUE)
    (application,) = connection.execute("PRAGMA application_id").fetchone()
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    if application != APPLICATION_ID:
        raise rig_error("not_a_session", path=path, text="it is another program's SQLite database")
    if version < 1:
        raise rig_error("not_a_session", path=path, text="it was never finished")
    if version > SCHEMA_VERSION:
        raise rig_error("session_newer", path=path, format=version, known=SCHEMA_VERSION)
    shapes = _schema(connection)
    own = _schema_of(version)
    changed = [name for name in own if shapes.get(name) != own[name]]
    altered = [f"{name} is missing or not as rig makes it" for name in changed]
    strange = sorted(shapes.keys() - own.keys() - _OF_ANALYZE)
    altered += [f"it has {name}, which rig does not make" for name in strange]
    if altered:
        raise rig_error("session_altered", path=path, text=altered[0])
    return int(version)


@cache
def _schema_of(version: int) -> dict[str, Row]:
    with closing(sqlite3.connect(":memory:")) as connection:
        connection.executescript(create_script(version))
        return _schema(connection)


def _schema(connection: sqlite3.Connection) -> dict[str, Row]:
    """Return the schema by name: tables with their columns, other objects as their SQL."""
    kinds = {name: tuple(how) for _, name, *how in connection.execute("PRAGMA table_list")}
    shapes: dict[str, Row] = {}
    rows = connection.execute("SELECT type, name, tbl_name, sql FROM main.sqlite_master")
    for kind, name, of, sql in rows:
        if kind == "table":
            columns = connection.execute("SELECT * FROM pragma_table_xinfo(?)", (name,))
            table_kind, _, *how = kinds.get(name, ("", 0))
            shapes[name] = (kind, table_kind, *how, *columns)
        else:
            shapes[name] = (kind, of, " ".join((sql or "").split()))
    return shapes
