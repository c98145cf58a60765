"""``rig replay`` believes nothing: a changed byte, edge, clock sample or result is found."""

import shutil

import pytest

from rig.link import messages as wire
from rig.link.frames import Decoder
from rig.recorder.recorder import Recorder
from rig.records import ClockSample
from rig.replay import replay
from rig.session.store import Session
from sim.board import VirtualBoard
from tests.cli.lab import drops_of
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


def test_a_release_sense_is_kept_and_comes_out_the_same(call, tmp_path, fence, monkeypatch):
    connect = Recorder.__init__

    def wired(recorder, *what):
        connect(recorder, *what)
        recorder._port.board.sense(0.0125)

    monkeypatch.setattr(Recorder, "__init__", wired)
    call("run", fence, "--port", "sim://", "--session", tmp_path / "s")
    with Session.open(tmp_path / "s", readonly=True) as session:
        senses = [drop.certificate.release_sense for drop in session.drops()]
    assert senses == [pytest.approx(200_000, rel=0.005)] * 2
    assert call("replay", tmp_path / "s").out.splitlines()[0] == "drops: 2 identical"


def test_a_session_is_identical_to_its_own_bytes(call, finished):
    drops, clock, results, last = call("replay", finished.session).out.splitlines()
    assert drops == "drops: 4 identical"
    assert clock == f"clock samples: {clock.split()[2]} identical"
    assert int(clock.split()[2]) > 4
    assert (results, last) == ("results: 4 identical", "identical")


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


def test_a_drop_whose_acknowledgement_was_lost_is_replayed_once(call, tmp_path, fence, monkeypatch):
    """The host stored it and said so into a dead cable: the next connection says it again."""
    receive, lost = VirtualBoard.receive, []

    def losing(board, start_ns, data):
        frames = Decoder().feed(data)
        if len(lost) < 8 and frames and frames[0].type == wire.CODES[wire.Acknowledge]:
            lost.append(data)
        else:
            receive(board, start_ns, data)

    monkeypatch.setattr(VirtualBoard, "receive", losing)
    command = ("run", fence, "--port", "sim://", "--session", tmp_path / "s")
    call(*command, code=4)
    assert len(lost) == 8
    call(*command)
    assert drops_of(tmp_path / "s") == [(1, 1), (2, 1)]
    assert call("replay", tmp_path / "s").out.splitlines()[0] == "drops: 2 identical"
