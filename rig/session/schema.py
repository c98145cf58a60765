"""The tables of a session file: one description, from which it is made, upgraded, read and checked.

Triggers keep raw records as they were made.
"""

from __future__ import annotations

import json
import math
from enum import StrEnum
from typing import TYPE_CHECKING, Any, NamedTuple

from rig.boards import GATES
from rig.session.reason_rows import read_reasons

if TYPE_CHECKING:
    from collections.abc import Callable

APPLICATION_ID = 0x43485247
"""``CHRG`` in the SQLite header: this database is a chain-rig session."""

SCHEMA_VERSION = 4
"""In SQLite's ``user_version``; a program refuses files with a higher one."""


class RunState(StrEnum):
    """Where a planned run stands; the log of these is only ever added to."""

    PLANNED = "planned"
    ARMED = "armed"
    FIRED = "fired"
    RECORDED = "recorded"
    ACCEPTED = "accepted"
    MARGINAL = "marginal"
    VOID = "void"
    REJECTED = "rejected"
    INTERRUPTED = "interrupted"


_U16, _U32, _INT64 = (1 << 16) - 1, (1 << 32) - 1, (1 << 63) - 1
_NS = (1 << 62) - 1  # two of them can be added: 146 years
_MOST_HZ = 10**12  # of imported times, whose unit is 1 ps; boards count far slower


class TableColumn(NamedTuple):
    """A column: its name, its SQL type, the values it accepts (in words, as a check), its age.

    `since` is the first format of the file that has it.
    """

    name: str
    sql: str
    accepted: str
    accepts: Callable[[Any], bool]
    since: int = 1


def _integer(
    name: str, low: int, high: int, sql: str = "INTEGER NOT NULL", *, since: int = 1
) -> TableColumn:
    """Return a column of whole numbers; one that is declared as INTEGER alone may be empty."""

    def accepts(value: object) -> bool:
        if value is None:
            return sql == "INTEGER"
        return type(value) is int and low <= value <= high

    return TableColumn(name, sql, f"a whole number from {low} to {high}", accepts, since)


def _counter(name: str, *, since: int = 1) -> TableColumn:
    """Return a column of 32-bit numbers that a device gives in a certificate, or of nothing."""
    return _integer(name, 0, _U32, "INTEGER", since=since)


def _host_ns(name: str = "host_ns", sql: str = "INTEGER NOT NULL") -> TableColumn:
    """Return a column of times of the host's clock."""
    return _integer(name, -_NS, _NS, sql)


def _text(name: str, sql: str = "TEXT NOT NULL") -> TableColumn:
    """Return a column of any text."""
    return TableColumn(name, sql, "text", lambda value: type(value) is str)


def _word(name: str, *words: str) -> TableColumn:
    """Return a column of some words."""
    quoted = ", ".join(f"'{word}'" for word in words)
    sql = f"TEXT NOT NULL CHECK ({name} IN ({quoted}))"
    return TableColumn(name, sql, f"one of {', '.join(words)}", lambda value: value in words)


def _json(name: str, accepted: str, read: Callable[[str], object]) -> TableColumn:
    """Return a column of JSON that `read` takes."""

    def accepts(value: Any) -> bool:
        try:
            read(value)
            # JSON's escapes can name halves of characters, which no file or screen takes.
            json.dumps(json.loads(value), ensure_ascii=False).encode()
        except (TypeError, ValueError, RecursionError):
            return False
        return True

    return TableColumn(name, f"TEXT NOT NULL CHECK (json_valid({name}))", accepted, accepts)


_TICK_HZ = _integer("tick_hz", 1, _MOST_HZ, "INTEGER NOT NULL CHECK (tick_hz > 0)")
_CHANNEL = _integer("channel", 0, GATES - 1, "INTEGER NOT NULL CHECK (channel >= 0)")
_IDENTITY: dict[str, Callable[[Any], bool]] = {
    "tick_hz": _TICK_HZ.accepts,
    "clock_u": lambda u: type(u) in {int, float} and math.isfinite(u) and 0 <= u < 1,
    "beams": lambda beams: type(beams) is list and all(map(_CHANNEL.accepts, beams)),
}


def read_identity(record: str) -> dict[str, Any]:
    """Read what a device or another timer is; what is calculated with must be possible.

    Raises
    ------
    TypeError, ValueError
        It is something else.
    """
    members = json.loads(record)
    if not isinstance(members, dict):
        raise TypeError(f"{record:.40} is no object")
    for name, accepts in _IDENTITY.items():
        if name in members and not accepts(members[name]):
            raise ValueError(f"{name} {members[name]!r:.40} cannot be")
    return members


class SessionTable:
    """A table that only grows.

    Parameters
    ----------
    columns
        In order; those of later formats come last.
    collides
        When a new row (``NEW``) would take the place of an old one, in SQL.
    constraint, option
        What its declaration says besides: of all columns, and behind them.
    since
        The first format of the file that has it.
    """

    def __init__(
        self,
        *columns: TableColumn,
        collides: str = "id = NEW.id",
        constraint: str = "",
        option: str = "",
        since: int = 1,
    ) -> None:
        self.columns, self.since = columns, since
        self.collides, self.constraint, self.option = collides, constraint, option
        self.numbered = columns[0].name == "id"

    def names(self, version: int = SCHEMA_VERSION) -> list[str]:
        """List the columns that a format has."""
        return [column.name for column in self.columns if column.since <= version]


_ID = _integer("id", 1, _INT64, "INTEGER PRIMARY KEY")
_RUN = _integer("run", 1, _INT64, "INTEGER NOT NULL CHECK (run >= 1)")
_TRIP = (_host_ns("host_send_ns"), _host_ns("host_recv_ns"))
_CERTIFIED = ("events", "crc32", "overflows", "glitches", "late")
_ACCOUNT = ("pulse_ticks", "pulse_end", "restarts", "supply_mv", "lowest_mv")
TABLES = {
    "meta": SessionTable(
        _text("key", "TEXT PRIMARY KEY"), _text("value"), collides="key = NEW.key"
    ),
    "protocol": SessionTable(
        _integer("id", 1, _INT64, "INTEGER PRIMARY KEY CHECK (id = 1)"),
        _text("source"),
        _text("text"),
    ),
    "identity": SessionTable(
        _ID, _host_ns(), _json("json", "a JSON object of a device", read_identity)
    ),
    "bytes": SessionTable(
        _ID,
        _host_ns(),
        _word("direction", "rx", "tx"),
        TableColumn("data", "BLOB NOT NULL", "bytes", lambda value: type(value) is bytes),
    ),
    "ping": SessionTable(_ID, *_TRIP, _integer("tick", 0, _U32)),
    "reference": SessionTable(
        _ID, *_TRIP, _integer("number", 0, _U16), _integer("tick", 0, _U32), since=3
    ),
    "host_break": SessionTable(
        _ID, _host_ns(), _host_ns("slept_ns"), _host_ns("stepped_ns"), since=3
    ),
    "drop": SessionTable(
        _ID,
        _RUN,
        _integer("attempt", 1, _INT64, "INTEGER NOT NULL CHECK (attempt >= 1)"),
        _TICK_HZ,
        _counter("fire_tick"),
        _integer("initial_state", 0, _U16),
        *map(_counter, _CERTIFIED),
        _json("faults", "a JSON list of reasons", read_reasons),
        _host_ns(sql="INTEGER"),
        _text("provenance"),
        _integer("release_sense", -_U32, _U32, "INTEGER", since=2),
        *(_counter(name, since=4) for name in _ACCOUNT),
        collides="id = NEW.id OR (run = NEW.run AND attempt = NEW.attempt)",
        constraint=", UNIQUE (run, attempt)",
    ),
    "edge": SessionTable(
        _integer("drop", 1, _INT64, 'INTEGER NOT NULL REFERENCES "drop" (id)'),
        _integer("idx", 0, _INT64, "INTEGER NOT NULL CHECK (idx >= 0)"),
        _integer("tick", -_INT64 - 1, _INT64),
        _CHANNEL,
        _integer("blocked", 0, 1, "INTEGER NOT NULL CHECK (blocked IN (0, 1))"),
        collides='"drop" = NEW."drop" AND idx = NEW.idx',
        constraint=', PRIMARY KEY ("drop", idx)',
        option=", WITHOUT ROWID",
    ),
    "run_state": SessionTable(
        _ID,
        _RUN,
        _integer("attempt", 0, _INT64, "INTEGER NOT NULL CHECK (attempt >= 0)"),
        _word("state", *RunState),
        _json("reasons", "a JSON list of reasons", read_reasons),
        _host_ns(),
    ),
}
"""By name."""

_BESIDES = """
CREATE INDEX run_state_by_run ON run_state (run, id);

-- Of older programs; results are derived, and nothing writes or reads them here any more.
CREATE TABLE result (run INTEGER NOT NULL, attempt INTEGER NOT NULL, analysis_version TEXT NOT NULL,
    json TEXT NOT NULL CHECK (json_valid(json)), PRIMARY KEY (run, attempt)) STRICT;
"""


def create_script(version: int = SCHEMA_VERSION) -> str:
    """Return the script that makes an empty session of a format inside a transaction."""
    return (
        "".join(_table_script(name, version) for name in TABLES if TABLES[name].since <= version)
        + _BESIDES
        + f"PRAGMA application_id = {APPLICATION_ID};\nPRAGMA user_version = {version};\n"
    )


def upgrade_script(version: int) -> str:
    """Return the script that makes a file of the format before one of this format."""
    script = ""
    for name, table in TABLES.items():
        if table.since == version:
            script += _table_script(name, version)
        for column in table.columns:
            if column.since == version:
                script += f'ALTER TABLE "{name}" ADD COLUMN {column.name} {column.sql};\n'
    return f"BEGIN; {script} PRAGMA user_version = {version}; COMMIT;"


def insert_statement(name: str) -> str:
    """Return the statement that adds a row of all columns to a table; an empty id is numbered."""
    values = ", ".join("?" * len(TABLES[name].columns))
    return f'INSERT INTO "{name}" VALUES ({values})'  # noqa: S608 - a constant of this file


def _table_script(name: str, version: int) -> str:
    table = TABLES[name]
    columns = ", ".join(f'"{c.name}" {c.sql}' for c in table.columns if c.since <= version)
    # "INSERT OR REPLACE" deletes without asking the delete trigger, so it has one of its own.
    refuse = f"SELECT RAISE(ABORT, '{name}: raw records are never altered');"
    return f"""
CREATE TABLE "{name}" ({columns}{table.constraint}) STRICT{table.option};
CREATE TRIGGER {name}_no_update BEFORE UPDATE ON "{name}" BEGIN {refuse} END;
CREATE TRIGGER {name}_no_delete BEFORE DELETE ON "{name}" BEGIN {refuse} END;
CREATE TRIGGER {name}_no_replace BEFORE INSERT ON "{name}"
WHEN EXISTS (SELECT 1 FROM "{name}" WHERE {table.collides}) BEGIN {refuse} END;
"""  # noqa: S608 - all names are constants of this file
