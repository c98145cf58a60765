"""The session keeps what it is given, in order, and lets nobody alter it unnoticed."""

import os
import random
import shutil
import sqlite3
from contextlib import closing
from dataclasses import replace

import pytest

from rig.errors import SessionError
from rig.reasons import make_reason, plain_reason
from rig.records import Certificate, ClockSample, Drop, Edge, HostBreak, Pulse
from rig.recover.examine import examine
from rig.recover.save import save
from rig.session.drop_check import ByteReplay
from rig.session.hashes import check_chain, protocol_first
from rig.session.schema import APPLICATION_ID, SCHEMA_VERSION, TABLES, RunState
from rig.session.store import Session
from tests.refusals import refused
from tests.session.altering import LATER, alter, killed, outdate
from tests.tables import cases

TEXT = "protocol: 1\ntitle: Übung\n"
DEVICE_DROP = Drop(
    run=2,
    attempt=1,
    tick_hz=2_000_000,
    edges=(Edge(10, 0, True), Edge(10, 1, True), Edge(900, 0, False)),
    fire_tick=4_000_000_000,
    initial_state=0x0100,
    certificate=Certificate(
        events=3, crc32=0xFFFF_FFFF, overflows=1, glitches=2, late=3, release_sense=-4
    ),
    faults=(make_reason("edges_lost", lost=1),),
)
IMPORTED = Drop(run=1, attempt=1, tick_hz=10**12, edges=(Edge(5, 15, False),))
PULSE = Pulse(5, 9, 65_535, 2**32 - 1)
BREAK = HostBreak(7, 2 * 10**9, -(10**9))


@pytest.fixture
def path(tmp_path):
    return tmp_path / "a session #1?.rig"


def tables(path):
    with closing(sqlite3.connect(path)) as connection:
        sql = "SELECT type, name FROM sqlite_master ORDER BY type, name"
        return connection.execute(sql).fetchall()


def make(path):
    return Session.create(path, TEXT, "uniform.yaml", simulated=True, origin="sim://")


def fill(session):
    session.log_bytes("tx", 1, b"\x00\xff")
    session.log_bytes("rx", 2, b"")
    session.add_identity({"serial": "µ1", "tick_hz": 2_000_000}, 3)
    session.add_timing(ClockSample(1, 2, 3))
    session.add_timing(ClockSample(4, 5, 2**32 - 1))
    session.add_timing(PULSE)
    session.add_timing(BREAK)
    session.add_drop(DEVICE_DROP, host_ns=99, provenance="device")
    session.add_drop(IMPORTED)
    session.add_state(2, 0, RunState.PLANNED, 1)
    session.add_state(2, 1, RunState.VOID, 2, [plain_reason("skew 7 ms"), plain_reason("β ≠ 0.5")])
    session.attach("rig µ.jpg", b"\xff\xd8")


def test_everything_comes_back_as_it_went_in(path):
    with make(path) as session:
        fill(session)
    with Session.open(path, readonly=True) as session:
        assert session.identities() == [(3, {"serial": "µ1", "tick_hz": 2_000_000})]
        assert [file[1:] for file in session.attached_files()] == [("rig µ.jpg", b"\xff\xd8")]
        replay = ByteReplay()
        assert list(session.drops(replay)) == [DEVICE_DROP, IMPORTED]
        assert replay.fed == 2
        assert session.latest_drops() == [IMPORTED, DEVICE_DROP]
        assert [entry.state for entry in session.states()] == [RunState.PLANNED, RunState.VOID]
        reasons = [reason.text for reason in session.latest_state(2).reasons]
        assert (reasons, session.latest_state(3)) == (["skew 7 ms", "β ≠ 0.5"], None)
        assert (session.protocol_text, session.protocol_source) == (TEXT, "uniform.yaml")
        assert session.simulated
        assert session.meta["origin"] == "sim://"
    assert [entry.name for entry in path.parent.iterdir()] == [path.name]


@pytest.fixture
def filled(path):
    with make(path) as session:
        fill(session)
    return path


@pytest.mark.parametrize("version", range(1, SCHEMA_VERSION))
def test_a_file_of_an_older_format_is_read_and_continued(path, filled, version):
    outdate(path, version)
    lost = [name for since in (2, 4) if since > version for name in LATER[since]]
    account = replace(DEVICE_DROP.certificate, **dict.fromkeys(lost))
    without = replace(DEVICE_DROP, certificate=account)
    pulses = [PULSE] if version >= 3 else []
    with Session.open(path, readonly=True) as session:
        session.check()
        assert list(session.drops()) == [without, IMPORTED]
        assert session.pulses() == pulses
        assert session.host_breaks() == [BREAK][: len(pulses)]
    examined = examine(path)
    assert (examined.damage, len(examined.rows.tables["drop"])) == ([], 2)
    more = [replace(DEVICE_DROP, attempt=number) for number in (2, 3)]
    for drop in more:
        with Session.open(path) as session:
            session.add_drop(drop)
    with Session.open(path) as session:
        session.add_timing(PULSE._replace(number=1))
        assert list(session.drops()) == [without, IMPORTED, *more]
        assert session.pulses() == [*pulses, PULSE._replace(number=1)]
    new = path.with_name("new.rig")
    make(new).close()
    assert tables(path) == tables(new), "an upgraded file is like a new one, guards and all"


@pytest.mark.parametrize("table", TABLES)
@cases
def test_raw_records_are_never_altered(filled, table, statement):
    refuse(filled, statement.format(table=f'"{table}"', column=f'"{TABLES[table].names()[-1]}"'))


def refuse(path, statement):
    with closing(sqlite3.connect(path)) as connection:
        before = list(connection.iterdump())
        refused(sqlite3.IntegrityError, "never altered", connection.execute, statement)
        assert list(connection.iterdump()) == before


def fill_disk(session):
    """Let the file grow no further; give its connection, by which it may again."""
    connection = session.connection
    (pages,) = connection.execute("PRAGMA page_count").fetchone()
    connection.execute(f"PRAGMA max_page_count = {pages}")
    error = refused(SessionError, "disk is full", session.log_bytes, "rx", 1, bytes(100_000))
    assert "free some space" in error.hint
    return connection


def test_what_waits_for_the_disk_is_saved_elsewhere_when_the_file_is_lost(path):
    with make(path) as session:
        fill_disk(session)
        session.add_drop(IMPORTED)
        path.unlink()
        refused(SessionError, "is saved as", session.commit)
    with Session.open(f"{path}.saved-1", readonly=True) as session:
        assert list(session.drops()) == [IMPORTED]


def test_who_only_reads_cannot_write(path):
    make(path).close()
    with Session.open(path, readonly=True) as reader:
        refused(SessionError, "read-only", reader.log_bytes, "rx", 1, b"x")
        refused(SessionError, "read-only", reader.commit)


def test_a_snapshot_does_not_move_while_another_writes(path):
    make(path).close()
    with Session.open(path, readonly=True) as reader, Session.open(path) as writer:
        writer.log_bytes("rx", 1, b"x")
        writer.commit()
        with reader.snapshot():
            with reader.snapshot():  # one in another is the same
                assert len(list(reader.byte_log())) == 1
            writer.log_bytes("rx", 2, b"y")
            writer.commit()
            assert len(list(reader.byte_log())) == 1
        assert len(list(reader.byte_log())) == 2
        with writer.snapshot():  # who writes sees its own records
            writer.log_bytes("rx", 3, b"z")
            assert len(list(writer.byte_log())) == 3


@pytest.mark.parametrize("closed", ["file", "folder"])
def test_where_either_cannot_be_written_nothing_is_put_beside_a_session(path, closed, monkeypatch):
    make(path).close()
    protected = path if closed == "file" else path.parent
    monkeypatch.setattr(os, "access", lambda where, _mode: where != protected)  # root may all
    with Session.open(path, readonly=True) as session:
        assert session.protocol_text == TEXT
        assert {one.name for one in path.parent.iterdir()} <= {path.name, f"{path.name}.lock"}


def test_closed_session_says_so(path):
    session = make(path)
    session.close()
    session.close()
    refused(SessionError, "closed", session.pings)
    refused(SessionError, "closed", session.commit)


def test_sigkill_keeps_every_committed_row_and_no_lock(path):
    code = """
for count in range(10**9):
    session.log_bytes("rx", count, b"0123456789" * 20)
    session.commit()
    print(count, flush=True)
"""
    with killed(code, path) as child:
        for _ in range(200):
            last = int(child.stdout.readline())
        assert refused(SessionError, f"written by process {child.pid}", Session.open, path).hint
        child.kill()
        last = max([last, *map(int, child.stdout.read().split("\n")[:-1])])
    with Session.open(path) as session:
        stamps = [chunk.host_ns for chunk in session.byte_log()]
    # The row after the last announced one may have been committed before the kill.
    assert stamps in (list(range(last + 1)), list(range(last + 2)))
    assert check_chain(examine(path).rows.tables) == []


def test_create_never_overwrites(path):
    path.write_text("precious")
    refused(SessionError, "already exists", make, path)
    assert path.read_text() == "precious"


@pytest.mark.parametrize("readonly", [False, True])
@cases
def test_what_is_no_session(path, kind, what, words, told, readonly, call):
    """Nothing of a session, or not one any more."""
    sql = f"{what}".format(later=SCHEMA_VERSION + 1, application=APPLICATION_ID)
    match kind:
        case "folder":
            path.mkdir()
        case "text":
            path.write_text(what)
        case "noise":
            path.write_bytes(random.Random(1).randbytes(50_000))
        case "database":
            with closing(sqlite3.connect(path)) as connection:
                connection.executescript(f"CREATE TABLE other (key, value); {sql}")
        case "altered":
            make(path).close()
            alter(path, sql)
        case "cut":
            make(path).close()
            path.write_bytes(path.read_bytes()[:5000])
    before = path.read_bytes() if path.is_file() else None
    error = refused(SessionError, words, Session.open, path, readonly=readonly)
    assert error.hint
    assert error.exit_code == 2
    assert (path.read_bytes() if path.is_file() else None) == before
    assert not path.with_name(path.name + ".lock").exists()
    if told is not None:  # of others `rig recover` may save something
        assert told in "".join(call("recover", path, code=2)[1:])
        call("recover", path, "-o", path.with_name("new"), code=2)
        assert not path.with_name("new").exists()


def record(session, run):
    session.log_bytes("rx", run, b"\x00\xff")
    session.add_timing(ClockSample(run, run + 1, run))
    session.add_drop(Drop(run, 1, 1000, (Edge(1, 0, True), Edge(9, 0, False))))
    session.add_state(run, 1, RunState.RECORDED, run)
    session.commit()


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    path = tmp_path_factory.mktemp("hashes") / "my.session"
    with make(path) as session:
        for run in range(1, 6):
            record(session, run)
    return path


def faults(path):
    return check_chain(examine(path).rows.tables)


def first(path):
    return protocol_first(examine(path).rows.in_order("hash"))


def test_what_is_as_recorded_has_no_fault(sound):
    assert faults(sound) == []
    assert first(sound) is True


@cases
def test_what_is_not_as_recorded_is_named(sql, damage, sound, tmp_path):
    path = tmp_path / "altered"
    shutil.copy(sound, path)
    alter(path, *sql.split("; "))
    assert examine(path).damage == damage


def test_an_old_file_has_no_chain_and_a_continued_one_says_since_when(path, filled):
    outdate(path, 4)
    before = path.read_bytes()
    assert (faults(path), first(path), path.read_bytes()) == ([], None, before)
    with Session.open(path) as session:
        record(session, 7)
    assert (faults(path), first(path)) == ([], None)
    alter(path, "UPDATE ping SET tick = 1 WHERE id = 1")
    assert faults(path) != [], "its older rows are hashed from then on"


def test_what_is_saved_of_a_damaged_file_does_not_claim_to_be_the_record(sound, tmp_path):
    new = tmp_path / "saved"
    save(examine(sound), new)
    assert (faults(new), first(new)) == ([], None)
