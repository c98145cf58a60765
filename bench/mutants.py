"""Sessions, protocols and CSV files as nobody made them on purpose, through what reads them.

Each is the same for the same seed. What a reader may raise is the project's own error alone.
"""

from __future__ import annotations

import random
import shutil
import sqlite3
from contextlib import closing
from typing import TYPE_CHECKING, Any

from bench.process_fixture import FENCE
from rig.errors import RigError
from rig.recorder.controller import Controller
from rig.recorder.published import PublishedState
from rig.session.store import Session

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

LONGEST_S = 20.0
VALUES: tuple[Any, ...] = (
    None, -1, 0, 7, 2**31, 2**63 - 1, -(2**63), 1.5, "", "abc", "null", "[]", "{}", "[1]", "[[]]",
    '{"a":', '["\\ud800"]', "\x1b[2J\u202e", 5000 * "[", b"", b"\xff\x00", b"text \xff",
)  # fmt: skip
"""Put into any column; of the last one SQLite says that it is text."""
CSV = "run,channel,time_s,state\n1,0,0.1,1\n1,0,0.2,0\n1,1,0.15,1\n1,1,0.25,0\n2,0,0.1,1\n"


def make_session(folder: Path, runs: int = 1) -> Path:
    """Record a few simulated drops."""
    protocol, session = folder / "fence.yaml", folder / "sound"
    protocol.write_text(FENCE.replace("RUNS", str(runs)), "utf-8")
    rig = Controller("sim://", PublishedState())
    try:
        rig.open_session(str(protocol), str(session), 3)
        for run in range(1, runs + 1):
            rig.fire(rig.arm(run, 1))
            rig.collect(run, 1)
    finally:
        rig.close()
    return session


class Mutants:
    """Mutants of one session, whose `columns` are those of every table.

    Parameters
    ----------
    sound
        The session.
    folder
        For what is in between.
    """

    def __init__(self, sound: Path, folder: Path) -> None:
        self._bytes = sound.read_bytes()
        self._loose = folder / "loose"
        shutil.copy(sound, self._loose)
        with closing(_connected(self._loose)) as connection:
            sql = "SELECT type, name, tbl_name, rootpage, sql FROM sqlite_master"
            self._schema = connection.execute(sql).fetchall()
            loose = [
                (f'CREATE TABLE "{name}" ({_columns(connection, name)}){_kept(sql)}', name)
                for kind, name, _, _, sql in self._schema
                if kind == "table"
            ]
            connection.execute("PRAGMA writable_schema = ON")
            connection.execute("DELETE FROM sqlite_master WHERE type = 'trigger'")
            connection.executemany("UPDATE sqlite_master SET sql = ? WHERE name = ?", loose)
        self._tables = [name for kind, name, *_ in self._schema if kind == "table"]
        with closing(_connected(self._loose)) as connection:
            self.columns = [
                (table, row[1])
                for table in self._tables
                for row in connection.execute(f'PRAGMA table_info("{table}")')
            ]

    def write(self, seed: int, path: Path) -> str:
        """Write one mutant; say what was done to it."""
        rng = random.Random(seed)
        return self._altered_value(rng, path) if seed % 2 else self._altered_bytes(rng, path)

    def _altered_bytes(self, rng: random.Random, path: Path) -> str:
        data, page = bytearray(self._bytes), 4096
        what = rng.choice(["bytes", "bytes", "cut", "blank", "exchanged"])
        at, other = (rng.randrange(len(data) // page) * page for _ in range(2))
        if what == "cut":
            del data[rng.randrange(len(data)) :]
        elif what == "blank":
            data[at : at + page] = bytes(page)
        elif what == "exchanged":
            data[at : at + page], data[other : other + page] = (
                data[other : other + page],
                data[at : at + page],
            )
        else:
            for _ in range(rng.randrange(1, 9)):
                data[rng.choice([at + rng.randrange(200), rng.randrange(len(data))])] = (
                    rng.randrange(256)
                )
        path.write_bytes(data)
        return what

    def _altered_value(self, rng: random.Random, path: Path) -> str:
        table, column = rng.choice(self.columns)
        # In one of five a table has no rows, too.
        emptied = rng.choice(self._tables) if rng.random() < 0.2 else ""
        value, row = rng.choice(VALUES), rng.randrange(3)
        return self.alter(path, table, column, value, row=row, emptied=emptied)

    def alter(
        self, path: Path, table: str, column: str, value: Any, *, row: int, emptied: str = ""
    ) -> str:
        """Write a mutant with another value in a row, and a table emptied; say what was done."""
        shutil.copy(self._loose, path)
        done = f"{table}.{column} = {value!r:.40} in row {row}"
        with closing(_connected(path)) as connection:
            key = '"drop", idx' if table == "edge" else "rowid"
            how = "CAST(? AS TEXT)" if value == VALUES[-1] else "?"
            try:
                connection.execute(
                    f'UPDATE "{table}" SET "{column}" = {how} WHERE ({key}) IN '  # noqa: S608
                    f'(SELECT {key} FROM "{table}" ORDER BY {key} LIMIT 1 OFFSET ?)',
                    (value, row),
                )
                if emptied:
                    connection.execute(f'DELETE FROM "{emptied}"')  # noqa: S608
            except sqlite3.Error:
                done += ", which cannot be"
            connection.execute("PRAGMA writable_schema = ON")
            connection.execute("DELETE FROM sqlite_master")
            connection.executemany("INSERT INTO sqlite_master VALUES (?, ?, ?, ?, ?)", self._schema)
        return done


def _connected(path: Path) -> sqlite3.Connection:
    connection = sqlite3.connect(path, isolation_level=None)
    connection.execute("PRAGMA journal_mode = OFF")
    connection.execute("PRAGMA synchronous = OFF")
    return connection


def _columns(connection: sqlite3.Connection, table: str) -> str:
    found = [row[1] for row in connection.execute(f'PRAGMA table_info("{table}")')]
    keys = {"meta": "key", "edge": '"drop", idx', "result": "run, attempt"}
    last = f"PRIMARY KEY ({keys[table]})" if table in keys else 'CHECK ("id" IS "id")'
    named = [f'"{one}"' + (" INTEGER PRIMARY KEY" if one == "id" else "") for one in found]
    unique = ["UNIQUE (run, attempt)"] if table == "drop" else []
    return ", ".join([*named, *unique, last])


def _kept(sql: str) -> str:
    return " WITHOUT ROWID" if "WITHOUT ROWID" in sql else ""


def read_through(path: Path) -> None:
    """Read everything that any command reads of a session."""
    with Session.open(path, readonly=True) as session:
        session.check()
        session.latest_state(1)


def failures(each: Callable[[int], object], seeds: range) -> list[str]:
    """Try each; tell of all that ended in another way than well or with the project's error."""
    found = []
    for seed in seeds:
        try:
            each(seed)
        except RigError:
            pass
        except Exception as error:
            found.append(f"seed {seed}: {type(error).__name__}: {error!s:.200}")
    return found
