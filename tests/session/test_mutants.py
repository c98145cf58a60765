"""Files that somebody sent, altered, old or of a broken board: read or refused in plain words."""

import json
import shutil
import sqlite3
from contextlib import closing
from hashlib import sha256

import pytest

from bench.mutants import Mutants, failures, make_session, read_through
from rig.errors import SessionError
from rig.records import Certificate, Drop, Edge
from rig.recover.examine import describe, examine
from rig.session import foreign
from rig.session.schema import TABLES, RunState, create_script, read_reasons
from rig.session.store import Session
from tests.refusals import refused
from tests.session.altering import unguarded
from tests.tables import cases


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    return make_session(tmp_path_factory.mktemp("sound"))


@pytest.fixture
def copied(sound, tmp_path):
    return shutil.copy(sound, tmp_path / "copied")


def run_sql(path, sql):
    with closing(sqlite3.connect(path)) as connection:
        connection.executescript(sql)


@pytest.fixture
def mutants(sound, tmp_path):
    return Mutants(sound, tmp_path)


@pytest.mark.parametrize(
    "seeds", [range(400), pytest.param(range(400, 2000), marks=pytest.mark.slow)], ids=str
)
def test_any_session_is_read_or_refused(seeds, mutants, tmp_path):
    path, done = tmp_path / "mutant", {}

    def each(seed):
        done[seed] = mutants.write(seed, path)
        read_through(path)

    assert [f"{one} {done[int(one[5:].split(':')[0])]}" for one in failures(each, seeds)] == []


def test_recover_tells_of_any_session_and_calls_none_whole_that_cannot_be_read(mutants, tmp_path):
    path = tmp_path / "mutant"

    def each(seed):
        what = mutants.write(seed, path)
        found = examine(path)
        assert all(line.isprintable() for line in describe(found))
        if found.whole:
            try:
                read_through(path)
            except SessionError as error:
                raise AssertionError(what) from error

    assert failures(each, range(150)) == []


@cases
def test_a_file_of_another_build_is_refused_before_a_row_is_read(sql, copied, call):
    run_sql(copied, sql)
    for readonly in (True, False):
        said = "built or altered by another program"
        refused(SessionError, said, Session.open, copied, readonly=readonly)
    assert "rig cannot read it" in call("recover", copied, code=SessionError.exit_code).out


@cases
def test_a_value_of_the_wrong_form_is_refused(sql, what, copied):
    with unguarded(copied) as connection:
        connection.execute("PRAGMA ignore_check_constraints = ON")
        connection.execute(sql)
    refused(SessionError, what, read_through, copied)


def test_what_somebodys_analyze_leaves_is_no_harm(copied):
    run_sql(copied, "ANALYZE")
    read_through(copied)


def test_a_statement_that_runs_away_is_ended(sound, monkeypatch):
    monkeypatch.setattr(foreign, "_MOST_STEPS", 10)
    monkeypatch.setattr(foreign, "_STEPS", 10)
    refused(SessionError, "far longer to read than any session", read_through, sound)


def test_more_edges_than_the_certificate_allows_are_not_read(copied):
    run_sql(
        copied,
        'INSERT INTO edge SELECT "drop", idx + 1000, tick, channel, blocked FROM edge, '
        "(WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 40) "
        "SELECT i * 1000 AS more FROM n) WHERE 0; "
        "WITH RECURSIVE n(i) AS (SELECT 1000 UNION ALL SELECT i + 1 FROM n WHERE i < 3000) "
        "INSERT INTO edge SELECT 1, i, i, 0, 1 FROM n;",
    )
    refused(SessionError, "run 1, attempt 1: it has more than", read_through, copied)


HZ = 16_000_000
TICKS = {
    "backwards": lambda n: HZ // 2 - 100 * n,
    "at the end of 64 bits": lambda n: 2**63 - 200 + n,
    "before all time": lambda n: n - 2**63,
    "at once": lambda _: 1000,
    "as fast as it can": lambda n: n,
}
COUNT = 200


@pytest.mark.parametrize("ticks", TICKS.values(), ids=TICKS)
def test_edges_that_cannot_be_are_kept_and_void(ticks, tmp_path, call):
    edges = tuple(Edge(ticks(n), n % 2, n // 2 % 2 == 0) for n in range(COUNT))
    session = make_session(tmp_path)
    with Session.open(session) as opened:
        # A pulse too short to be seen leaves open what the CRC is of.
        account = Certificate(COUNT + 1, crc32=1, glitches=1)
        opened.add_drop(Drop(1, 2, HZ, edges, 5, 0, account), provenance="device")
        opened.add_state(1, 2, RunState.RECORDED, 10**12)
    (run,) = call("analyze", "--json", session, code=3).json["runs"]
    assert run["verdict"] == "void"
    assert run["reasons"]


@cases
def test_a_sentence_of_an_old_file_is_read_as_it_stands(sentence, code):
    (reason,) = read_reasons(json.dumps([sentence]))
    assert (reason.code, reason.values["text"]) == (code, sentence.removeprefix("note: "))


@cases
def test_the_tables_of_each_format_are_what_files_have(version, digest):
    assert sha256(create_script(version).encode()).hexdigest() == digest


@cases
def test_columns_take_whole_numbers_within_these_limits(low, high, empty, columns):
    tried = [low - 1, low, high, high + 1, None, 1.5]
    for place in columns.split():
        table, name = place.split(".")
        (kind,) = [column.kind for column in TABLES[table].columns if column.name == name]
        taken = [kind.accepts([value]) for value in tried]
        assert taken == [False, True, True, False, empty, False], place
