"""What `rig recover` says of damaged sessions, and what it saves of them."""

import random
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from rig.errors import SessionError
from rig.recover.drops import Fate
from rig.recover.examine import describe, examine
from rig.recover.save import save
from rig.replay import replay
from rig.session.schema import SCHEMA_VERSION
from rig.session.store import Session
from tests.refusals import refused
from tests.session.altering import alter, killed, outdate
from tests.tables import cases


@pytest.fixture
def copy(fences, tmp_path):
    return Path(shutil.copy(fences, tmp_path / "copy.session"))


def content(path):
    """Everything raw that a session has."""
    with Session.open(path, readonly=True) as session:
        return {
            "bytes": list(session.byte_log()),
            "drops": list(session.drops()),
            "states": session.states(),
            "protocol": (session.protocol_source, session.protocol_text),
            "simulated": session.simulated,
            "rest": [session.pings(), session.identities(), session.meta["origin"]],
        }


@pytest.fixture(scope="module")
def truth(fences):
    return content(fences)


def by_job(drops):
    return {(drop.run, drop.attempt): drop for drop in drops}


def saved(path, folder, **options):
    """Save what is left; give its content and what was said to be missing."""
    new = folder / "new.session"
    missing = save(examine(path), new, **options)
    return content(new), missing


def test_a_sound_session_is_whole_and_stays_as_it_is(copy, truth, tmp_path, call):
    before = copy.read_bytes()
    lines = call("recover", copy).out.splitlines()
    assert lines[-1] == "everything is whole"
    assert sum(line.endswith(str(Fate.CONFIRMED)) for line in lines) == len(truth["drops"])
    assert copy.read_bytes() == before
    assert [path.name for path in tmp_path.iterdir()] == [copy.name]
    again, missing = saved(copy, tmp_path)
    assert missing == []
    assert again == truth


@pytest.mark.parametrize("part", [n / 12 for n in range(1, 12)])
def test_a_torn_file_gives_what_is_before_the_tear(part, fences, copy, truth, tmp_path):
    size = round(copy.stat().st_size * part)
    copy.write_bytes(copy.read_bytes()[:size])
    found = examine(copy)
    assert not found.whole
    assert any("the file is torn" in what for what in found.damage)
    again, missing = saved(copy, tmp_path, protocol=str(fences.with_name("fences.yaml")))
    assert again["simulated"]
    known = by_job(truth["drops"])
    by_key = {(one.drop.run, one.drop.attempt): one for one in found.drops}
    for drop in again["drops"]:
        key = drop.run, drop.attempt
        if by_key[key].fate is Fate.PARTIAL:
            assert drop.faults
            assert any(what.startswith(f"run {key[0]}, attempt {key[1]}: ") for what in missing)
        else:
            assert drop == known[key]
    assert set(again["bytes"]) <= set(truth["bytes"])
    assert set(again["states"]) <= set(truth["states"]) or missing


def test_edges_that_are_lost_come_again_from_the_bytes(copy, truth, tmp_path):
    alter(
        copy,
        'DELETE FROM edge WHERE "drop" = 2 AND idx > 3',
        'DELETE FROM edge WHERE "drop" = 3',
        'UPDATE edge SET tick = tick + 64 WHERE "drop" = 4 AND idx = 5',
    )
    fates = [drop.fate for drop in examine(copy).drops]
    assert fates[:5] == [Fate.CONFIRMED, *[Fate.RESTORED] * 3, Fate.CONFIRMED]
    assert saved(copy, tmp_path) == (truth, [])
    with Session.open(tmp_path / "new.session", readonly=True) as session:
        assert replay(session).lines[-1] == "identical"


OPEN = "DELETE FROM bytes WHERE direction = 'tx' AND host_ns >= "
UNKNOWN = OPEN + '(SELECT host_ns FROM "drop" WHERE id = 5)'


@pytest.mark.parametrize("before", [(), [UNKNOWN]], ids=["acknowledged", "held by the board"])
def test_a_drop_that_is_lost_whole_comes_again_from_the_bytes(before, copy, truth, tmp_path):
    alter(copy, *before, 'DELETE FROM edge WHERE "drop" = 5', 'DELETE FROM "drop" WHERE id = 5')
    assert "1 drops" in examine(copy).lost
    again, _ = saved(copy, tmp_path)
    assert by_job(again["drops"]) == by_job(truth["drops"])


@pytest.mark.parametrize(
    "seed", [*range(10), *(pytest.param(n, marks=pytest.mark.slow) for n in range(10, 100))]
)
def test_no_flipped_bit_changes_a_drop_unnoticed(seed, fences, copy, truth, tmp_path):
    chance = random.Random(seed)
    data = bytearray(copy.read_bytes())
    for _ in range(chance.choice([1, 1, 3, 30])):
        data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
    copy.write_bytes(data)
    found = examine(copy)
    assert describe(found)
    known = by_job(truth["drops"])
    sure = {Fate.CONFIRMED, Fate.RESTORED}
    for one in found.drops:
        if one.fate in sure:
            assert one.drop == known[one.drop.run, one.drop.attempt]
    again, _ = saved(copy, tmp_path, protocol=str(fences.with_name("fences.yaml")))
    assert len(again["drops"]) >= len(truth["drops"]) - 2


@pytest.mark.parametrize("size", [4096, 65536])
def test_without_its_first_pages_the_rest_is_read(size, copy, truth, tmp_path):
    """The roots of all tables may be in them: SQLite itself finds nothing without them."""
    copy.write_bytes(bytes(size) + copy.read_bytes()[size:])
    examined = examine(copy)
    assert examined.damage
    assert [drop.drop for drop in examined.drops] == truth["drops"]
    if size == 4096:
        assert saved(copy, tmp_path)[0]["drops"] == truth["drops"]


# -- the log beside the file


WRITE = """
from rig.records import Drop, Edge
from rig.session.schema import RunState
for run in range(1, 30):
    edges = tuple(Edge(1000 * n, n % 3, n % 2 == 0) for n in range(50))
    session.add_drop(Drop(run, 1, 16_000_000, edges), provenance="import")
    session.add_state(run, 1, RunState.RECORDED, run)
    session.commit()
print("ready", flush=True)
sys.stdin.read()
"""


@pytest.fixture(scope="module")
def dead(tmp_path_factory):
    """Leave a session as a killed process does."""
    path = tmp_path_factory.mktemp("dead") / "killed.session"
    with killed(WRITE, path) as writer:
        assert writer.stdout.readline() == "ready\n"
    assert path.with_name("killed.session-wal").stat().st_size > 4096
    return path.parent


@pytest.fixture
def logged(dead, tmp_path):
    """Give a session of which all is in the log beside it, and the log."""
    shutil.copytree(dead, tmp_path, dirs_exist_ok=True)
    return tmp_path / "killed.session", tmp_path / "killed.session-wal"


def test_what_is_in_the_log_only_is_read_and_left_there(logged):
    """Beside a lock that its dead writer left."""
    path, log = logged
    before = path.read_bytes(), log.read_bytes()
    found = examine(path)
    assert found.whole
    assert found.snapshot.writer == ""
    assert [one.drop.run for one in found.drops] == list(range(1, 30))
    assert any("pages are in the log beside it" in line for line in describe(found))
    assert (path.read_bytes(), log.read_bytes()) == before


def test_without_its_log_a_session_is_poorer_and_says_what_to_look_for(logged):
    path, log = logged
    log.unlink()
    found = examine(path)
    assert found.whole
    assert found.drops == []
    assert "-wal" in describe(found)[-1]


@pytest.mark.parametrize("part", [0.1, 0.4, 0.77, 0.99])
def test_a_torn_log_counts_up_to_its_last_whole_commit(part, logged):
    path, log = logged
    log.write_bytes(log.read_bytes()[: round(log.stat().st_size * part)])
    found = examine(path)
    assert not found.foreign
    runs = [one.drop.run for one in found.drops]
    assert runs == list(range(1, len(runs) + 1))
    with closing(sqlite3.connect(path)) as connection:  # SQLite judges what was committed
        assert connection.execute('SELECT count(*) FROM "drop"').fetchone() == (len(runs),)


def test_a_damaged_log_counts_up_to_the_damage(logged):
    path, log = logged
    data = bytearray(log.read_bytes())
    data[len(data) // 2] ^= 1
    log.write_bytes(data)
    before = path.read_bytes(), log.read_bytes()
    assert 0 < len(examine(path).drops) < 29
    assert (path.read_bytes(), log.read_bytes()) == before


def test_a_log_is_read_though_the_files_first_page_is_lost(logged):
    path, _ = logged
    path.write_bytes(bytes(4096) + path.read_bytes()[4096:])
    assert [one.drop.run for one in examine(path).drops] == list(range(1, 30))


def test_a_session_that_is_being_written(tmp_path):
    path = tmp_path / "live.session"
    with killed(WRITE, path) as writer:
        assert writer.stdout.readline() == "ready\n"
        found = examine(path)
        said = describe(found)
    assert found.whole
    assert len(found.drops) == 29
    assert any(f"being written by process {writer.pid}" in line for line in said)


def test_a_file_that_may_only_be_read(copy, monkeypatch):
    monkeypatch.setattr("os.access", lambda *_: False)  # root may write everything
    assert any("may not be written" in line for line in describe(examine(copy)))


# -- what must be given, and what is guessed


@cases
def test_a_protocol_that_is_lost_or_altered_must_be_given(sql, said, fences, copy, truth, tmp_path):
    alter(copy, *sql)
    lost = "has lost its protocol file"
    assert "--protocol" in refused(SessionError, lost, save, examine(copy), tmp_path / "new").hint
    again, missing = saved(copy, tmp_path, protocol=str(fences.with_name("fences.yaml")))
    assert again["protocol"] == truth["protocol"]
    assert again["simulated"]  # as its board says
    assert any(said in line for line in missing)


@pytest.mark.parametrize("version", range(1, SCHEMA_VERSION))
def test_a_drop_of_an_older_format_is_confirmed_by_its_bytes(version, copy):
    outdate(copy, version)
    assert {one.fate for one in examine(copy).drops} == {Fate.CONFIRMED}


def test_what_may_be_simulated_is_stamped_so(copy, tmp_path):
    alter(copy, "DELETE FROM meta WHERE key = 'simulated'", "DELETE FROM identity")
    again, missing = saved(copy, tmp_path)
    assert again["simulated"]
    assert any("stamped as simulated" in line for line in missing)
