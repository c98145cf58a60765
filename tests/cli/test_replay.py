"""``rig replay`` believes nothing: a changed byte, edge, clock sample or result is found."""

import shutil

import pytest

from rig.records import ClockSample
from rig.replay import replay
from rig.session.store import Session
from tests.session.altering import unguarded
from tests.tables import cases


@pytest.fixture
def fenced(fences, tmp_path):
    """Copy a session that is quickly analysed."""
    return shutil.copy(fences, tmp_path / "copy.session")


def tamper(session, sql, *values):
    """Change a session behind its back, guards taken away first."""
    with unguarded(session) as connection:
        assert connection.execute(sql, values).rowcount == 1


def test_what_is_recorded_meanwhile_is_no_difference(fenced, monkeypatch):
    read = Session.byte_log
    with Session.open(fenced) as writer, Session.open(fenced, readonly=True) as reader:

        def late(self, after=0):
            yield from read(self, after)
            writer.add_timing(ClockSample(1, 2, 3))
            writer.commit()

        monkeypatch.setattr(Session, "byte_log", late)
        assert replay(reader).lines[-1] == "identical"
        assert reader.pings()[-1] == ClockSample(1, 2, 3)


@cases
def test_what_was_tampered_with_is_called_different(call, fenced, sql, found):
    tamper(fenced, sql)
    found, done = set(found), call("replay", fenced, code={0, 1})
    *lines, last = done.out.splitlines()
    different = {line.partition(":")[0] for line in lines if line.endswith("DIFFERENT")}
    assert different >= found
    assert different - found <= {"results"}
    assert done.code == (1 if different else 0)
    assert last == (
        f"DIFFERENT: {', '.join(line.partition(':')[0] for line in lines if 'DIFF' in line)}"
        if different
        else "identical"
    )
