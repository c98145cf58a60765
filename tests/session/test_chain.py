"""Rows of a session hang together: one that is altered, removed or moved shows, and is named."""

from __future__ import annotations

import random
import shutil
import sqlite3
import subprocess
import sys
from contextlib import closing

import pytest

from rig.session.chain import check_chain
from rig.session.store import Session
from tests.session.altering import unguarded
from tests.session.test_session_store import fill, make
from tests.waiting import PATIENCE_S

TABLES = ("meta", "protocol", "identity", "bytes", "ping", "reference", "host_break", "drop",
          "edge", "run_state", "attachment")  # fmt: skip
WRITER = """
import sys
from rig.session.schema import RunState
from rig.session.chain import check_chain
from rig.session.store import Session
session = Session.open(sys.argv[1])
print("ready", flush=True)
for number in range(1, 100000):
    session.log_bytes("rx", number, b"x" * (number % 50))
    session.add_state(number, 1, RunState.RECORDED, number)
    if number % 3 == 0:
        session.commit()
        print(number, flush=True)
"""


@pytest.fixture
def session(tmp_path):
    path = tmp_path / "session"
    with make(path) as opened:
        fill(opened)
        opened.commit()
        fill_again(opened)
        opened.attach("photo.jpg", b"\xff\xd8")
    return path


def fill_again(opened):
    for number in range(3, 9):
        opened.log_bytes("rx", number, bytes([number]))
        opened.commit()


def chain_of(path):
    with Session.open(path, readonly=True) as opened:
        return opened.chain()


def test_a_session_as_recorded_is_whole(session):
    assert chain_of(session).faults == []
    assert chain_of(session).links[:2] == ["meta", "protocol"]
    with Session.open(session) as opened:  # by another process, as for a note
        opened.add_identity({"serial": "A2"}, 4)
    assert chain_of(session).faults == []


def test_any_value_altered_is_named(session, tmp_path):
    chance = random.Random(3)
    with closing(sqlite3.connect(session)) as connection:
        columns = [
            (table, column[1], column[2])
            for table in TABLES
            for column in connection.execute(f'PRAGMA table_info("{table}")')
        ]
        rows = {
            table: connection.execute(f'SELECT * FROM "{table}"').fetchall() for table in TABLES
        }
    others = {"INTEGER": 123_456, "TEXT": "[1]", "BLOB": b"other"}
    for table, column, kind in columns:
        copy = tmp_path / "copy"
        shutil.copy(session, copy)
        same = " AND ".join(f'"{name}" IS ?' for at, name, _ in columns if at == table)
        with unguarded(copy) as connection:
            connection.execute("PRAGMA ignore_check_constraints = ON")
            sql = f'UPDATE "{table}" SET "{column}" = ? WHERE {same}'
            assert (
                connection.execute(sql, (others[kind], *chance.choice(rows[table]))).rowcount == 1
            )
        with closing(sqlite3.connect(copy)) as connection:
            faults = check_chain(connection).faults
        assert any(f"table {table}" in fault for fault in faults), (table, column, faults)


@pytest.mark.parametrize(
    ("sql", "fault"),
    [
        ("DELETE FROM ping WHERE id = 1", "table ping, rows 1 to 2: not as recorded"),
        ("DELETE FROM ping", "table ping, rows 1 to 2: not as recorded"),
        ("DELETE FROM bytes WHERE id = 5", "table bytes, rows 5 to 5: not as recorded"),
        (
            "UPDATE ping SET id = 9 WHERE id = 1; UPDATE ping SET id = 1 WHERE id = 2; "
            "UPDATE ping SET id = 2 WHERE id = 9",
            "table ping, rows 1 to 2: not as recorded",
        ),
        ('UPDATE edge SET tick = 11 WHERE "drop" = 1', "table edge, rows 1 to 2: not as recorded"),
        (
            "INSERT INTO ping (host_send_ns, host_recv_ns, tick) VALUES (1, 2, 3)",
            "table ping: rows after 2 are in no link",
        ),
        ("DELETE FROM chain WHERE id = 4", "chain: link 4 is missing, or of no table"),
        ("UPDATE chain SET name = 'x' WHERE id = 4", "chain: link 4 is missing, or of no table"),
        ("UPDATE chain SET digest = x'00' WHERE id = 1", "table meta, rows 1 to 6"),
        (
            "DELETE FROM chain WHERE id = (SELECT MAX(id) FROM chain)",
            "table attachment: rows after 0 are in no link",
        ),
    ],
)
def test_what_was_done_to_rows_is_named(sql, fault, session):
    with unguarded(session) as connection:
        for statement in sql.split("; "):
            connection.execute(statement)
    assert any(found.startswith(fault) for found in chain_of(session).faults)


def test_a_session_of_an_older_format_has_none_until_it_is_continued(session):
    with closing(sqlite3.connect(session)) as connection:
        for table in ("chain", "attachment"):
            connection.execute(f"DROP TABLE {table}")
        connection.execute("PRAGMA user_version = 4")
    assert chain_of(session) == ([], [])
    assert "older program" in str(chain_of(session))
    with Session.open(session) as opened:
        opened.log_bytes("rx", 3, b"x")
    assert "continued" in str(chain_of(session))
    assert chain_of(session).faults == []
    assert chain_of(session).protocol_first is None


def test_it_is_whole_whenever_the_writer_is_killed(session):
    chance = random.Random(1)
    for _ in range(6):
        with subprocess.Popen(
            [sys.executable, "-c", WRITER, session], stdout=subprocess.PIPE, text=True
        ) as writer:
            assert writer.stdout.readline() == "ready\n"
            for _ in range(chance.randrange(1, 40)):
                writer.stdout.readline()
            writer.kill()
            writer.wait(PATIENCE_S)
        assert chain_of(session).faults == []
        session_wal = session.with_name(session.name + "-wal")
        assert session_wal.exists()


def test_a_commit_that_failed_leaves_no_gap(session):
    with Session.open(session) as opened:
        connection = opened.connection
        (pages,) = connection.execute("PRAGMA page_count").fetchone()
        connection.execute(f"PRAGMA max_page_count = {pages}")
        with pytest.raises(OSError, match="disk is full"):
            opened.log_bytes("rx", 1, bytes(100_000))
        opened.log_bytes("rx", 2, b"waits")
        with pytest.raises(OSError, match="disk is full"):
            opened.commit()
        connection.execute("PRAGMA max_page_count = 100000")
        opened.commit()
        assert opened.chain().faults == []
    assert chain_of(session).faults == []


def test_what_is_saved_elsewhere_has_a_whole_chain(session):
    with Session.open(session) as opened:
        opened.log_bytes("rx", 3, b"x")
        session.unlink()
        with pytest.raises(OSError, match="saved"):
            opened.commit()
    (saved,) = session.parent.glob("session.saved-*")
    assert chain_of(saved).faults == []
