"""The chain of hashes: what is altered, removed or reordered behind a session's back is named."""

from __future__ import annotations

import shutil

import pytest

from rig.records import ClockSample, Drop, Edge
from rig.recover.examine import examine
from rig.recover.save import save
from rig.session.hashes import protocol_first
from rig.session.schema import RunState
from rig.session.store import Session
from tests.session.altering import unguarded
from tests.session.test_session_store import make, make_older
from tests.tables import cases


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
    return examine(path).rows.chain_faults()


def first(path):
    return protocol_first(examine(path).rows.in_order("hash"))


def test_what_is_as_recorded_has_no_fault(sound, tmp_path):
    assert faults(sound) == []
    assert first(sound) is True
    copy = tmp_path / "copy"
    shutil.copy(sound, copy)
    with Session.open(copy) as session:  # a writer after another goes on
        record(session, 6)
    assert faults(copy) == []


@cases
def test_what_is_not_as_recorded_is_named(sql, fault, sound, tmp_path):
    path = tmp_path / "altered"
    shutil.copy(sound, path)
    with unguarded(path) as connection:
        if "7 - id" in sql:
            connection.execute("UPDATE ping SET id = -id WHERE id IN (3, 4)")
            sql = "UPDATE ping SET id = 7 + id WHERE id < 0"
        connection.execute(sql)
    damage = examine(path).damage
    assert any(line.startswith("table " + fault) for line in damage), damage


def test_an_old_file_has_no_chain_and_a_continued_one_says_since_when(tmp_path):
    path = tmp_path / "old"
    make_older(path, 4)
    before = path.read_bytes()
    assert (faults(path), first(path), path.read_bytes()) == ([], None, before)
    with Session.open(path) as session:
        record(session, 7)
    assert (faults(path), first(path)) == ([], None)
    with unguarded(path) as connection:
        connection.execute("UPDATE ping SET tick = 1 WHERE id = 1")
    assert faults(path) != [], "its older rows are hashed from then on"


def test_what_is_saved_of_a_damaged_file_does_not_claim_to_be_the_record(sound, tmp_path):
    new = tmp_path / "saved"
    save(examine(sound), new)
    assert (faults(new), first(new)) == ([], None)
