"""The tables of a session file, and the triggers that keep raw records as they were made."""

from __future__ import annotations

from enum import StrEnum

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


_STATES = ", ".join(f"'{state}'" for state in RunState)

_CLOCK_TABLES = """
CREATE TABLE reference (
    id INTEGER PRIMARY KEY,
    host_send_ns INTEGER NOT NULL,
    host_recv_ns INTEGER NOT NULL,
    number INTEGER NOT NULL,
    tick INTEGER NOT NULL
) STRICT;

CREATE TABLE host_break (
    id INTEGER PRIMARY KEY,
    host_ns INTEGER NOT NULL,
    slept_ns INTEGER NOT NULL,
    stepped_ns INTEGER NOT NULL
) STRICT;
"""

_ACCOUNT = tuple(
    f"{name} INTEGER" for name in ("pulse_ticks", "pulse_end", "restarts", "supply_mv", "lowest_mv")
)
"""What a certificate of the wire's version 2 says besides."""

_TABLES = f"""
CREATE TABLE meta (
    key TEXT PRIMARY KEY,
    value TEXT NOT NULL
) STRICT;

CREATE TABLE protocol (
    id INTEGER PRIMARY KEY CHECK (id = 1),
    source TEXT NOT NULL,
    text TEXT NOT NULL
) STRICT;

CREATE TABLE identity (
    id INTEGER PRIMARY KEY,
    host_ns INTEGER NOT NULL,
    json TEXT NOT NULL CHECK (json_valid(json))
) STRICT;

CREATE TABLE bytes (
    id INTEGER PRIMARY KEY,
    host_ns INTEGER NOT NULL,
    direction TEXT NOT NULL CHECK (direction IN ('rx', 'tx')),
    data BLOB NOT NULL
) STRICT;

CREATE TABLE ping (
    id INTEGER PRIMARY KEY,
    host_send_ns INTEGER NOT NULL,
    host_recv_ns INTEGER NOT NULL,
    tick INTEGER NOT NULL
) STRICT;

CREATE TABLE "drop" (
    id INTEGER PRIMARY KEY,
    run INTEGER NOT NULL CHECK (run >= 1),
    attempt INTEGER NOT NULL CHECK (attempt >= 1),
    tick_hz INTEGER NOT NULL CHECK (tick_hz > 0),
    fire_tick INTEGER,
    initial_state INTEGER NOT NULL,
    events INTEGER,
    crc32 INTEGER,
    overflows INTEGER,
    glitches INTEGER,
    late INTEGER,
    faults TEXT NOT NULL CHECK (json_valid(faults)),
    host_ns INTEGER,
    provenance TEXT NOT NULL,
    release_sense INTEGER,
    {", ".join(_ACCOUNT)},
    UNIQUE (run, attempt)
) STRICT;

CREATE TABLE edge (
    "drop" INTEGER NOT NULL REFERENCES "drop" (id),
    idx INTEGER NOT NULL CHECK (idx >= 0),
    tick INTEGER NOT NULL,
    channel INTEGER NOT NULL CHECK (channel >= 0),
    blocked INTEGER NOT NULL CHECK (blocked IN (0, 1)),
    PRIMARY KEY ("drop", idx)
) STRICT, WITHOUT ROWID;

CREATE TABLE run_state (
    id INTEGER PRIMARY KEY,
    run INTEGER NOT NULL CHECK (run >= 1),
    attempt INTEGER NOT NULL CHECK (attempt >= 0),
    state TEXT NOT NULL CHECK (state IN ({_STATES})),
    reasons TEXT NOT NULL CHECK (json_valid(reasons)),
    host_ns INTEGER NOT NULL
) STRICT;

CREATE INDEX run_state_by_run ON run_state (run, id);

-- Of older programs; results are derived, and nothing writes or reads them here any more.
CREATE TABLE result (
    run INTEGER NOT NULL,
    attempt INTEGER NOT NULL,
    analysis_version TEXT NOT NULL,
    json TEXT NOT NULL CHECK (json_valid(json)),
    PRIMARY KEY (run, attempt)
) STRICT;
"""

_IDENTICAL = {
    "meta": "key = NEW.key",
    "protocol": "id = NEW.id",
    "identity": "id = NEW.id",
    "bytes": "id = NEW.id",
    "ping": "id = NEW.id",
    "reference": "id = NEW.id",
    "host_break": "id = NEW.id",
    "drop": "id = NEW.id OR (run = NEW.run AND attempt = NEW.attempt)",
    "edge": '"drop" = NEW."drop" AND idx = NEW.idx',
    "run_state": "id = NEW.id",
}
"""Tables that only grow, and what makes a new row collide with an old one."""


def _guards(table: str, identical: str) -> str:
    # "INSERT OR REPLACE" deletes without asking the delete trigger, so it has one of its own.
    refuse = f"SELECT RAISE(ABORT, '{table}: raw records are never altered');"
    return f"""
CREATE TRIGGER {table}_no_update BEFORE UPDATE ON "{table}" BEGIN {refuse} END;
CREATE TRIGGER {table}_no_delete BEFORE DELETE ON "{table}" BEGIN {refuse} END;
CREATE TRIGGER {table}_no_replace BEFORE INSERT ON "{table}"
WHEN EXISTS (SELECT 1 FROM "{table}" WHERE {identical}) BEGIN {refuse} END;
"""  # noqa: S608 - all names are constants of this file


UPGRADES = {
    1: 'ALTER TABLE "drop" ADD COLUMN release_sense INTEGER',
    2: _CLOCK_TABLES
    + "".join(_guards(table, _IDENTICAL[table]) for table in ("reference", "host_break")),
    3: "; ".join(f'ALTER TABLE "drop" ADD COLUMN {column}' for column in _ACCOUNT),
}
"""What makes a file of one version one of the next."""

LATER: dict[str, tuple[tuple[int, ...], int]] = {
    "drop": ((2, *(4 for _ in _ACCOUNT)), 1),
    **{
        name: ((), 3)
        for table in ("reference", "host_break")
        for name in (table, *(f"{table}_no_{what}" for what in ("update", "delete", "replace")))
    },
}
"""Since which version a table has its last columns, and since which it is there at all."""

CREATE = (
    _TABLES
    + _CLOCK_TABLES
    + "".join(_guards(table, identical) for table, identical in _IDENTICAL.items())
    + f"PRAGMA application_id = {APPLICATION_ID};\nPRAGMA user_version = {SCHEMA_VERSION};\n"
)
"""One script that makes an empty session inside a transaction."""
