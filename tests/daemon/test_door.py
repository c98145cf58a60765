"""A daemon that no client finds any more, or whose session is gone, ends and loses nothing."""

import os
import shutil
import socket
import time
from itertools import product

import pytest

from bench.process_fixture import ProcessFixture
from rig.errors import RigError, SessionError
from rig.session.store import Session
from tests.daemon.at_work import ended, let_fall, working
from tests.refusals import refused
from tests.waiting import until


@pytest.fixture
def state(tmp_path, monkeypatch):
    """Name the folder for logs and for sessions without a place."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    return tmp_path / "chainrig"


@pytest.fixture
def processes(state):
    with ProcessFixture(runs=1, seed=3) as made:
        yield made


def delete(place):
    shutil.rmtree(place.parent)


def move(place):
    place.parent.rename(place.parent.with_name("elsewhere"))


def replace(place):
    place.unlink()
    with socket.socket(socket.AF_UNIX) as other:
        other.bind(str(place))


@pytest.mark.parametrize(
    ("lose", "option"), [(delete, ()), (move, ("--idle-timeout", "300")), (replace, ())]
)
def test_without_its_socket_it_ends(processes, state, lose, option):
    processes.start_daemon(*option)
    place = processes.socket
    lose(place)
    assert "was deleted, moved or replaced" in ended(processes, 2)
    assert "was deleted, moved or replaced" in (state / "daemon.log").read_text("utf-8")
    assert place.exists() == (lose is replace), "another daemon's is not taken away"


def test_it_stays_for_the_clients_that_it_has(processes):
    processes.start_daemon()
    client = processes.client()
    until(lambda: client.call("subscribe")["state"]["link"]["state"] == "up")
    delete(processes.socket)
    time.sleep(0.5)  # it looks ten times a second
    assert client.call("subscribe")["state"]["daemon"]["pid"] == processes.daemon.pid
    assert client.call("renew") == {"disk_s": 0.0}
    client.close()
    ended(processes, 2)


def test_where_all_was_deleted_under_it_it_saves_what_it_has_and_ends(processes, state):
    processes.start_daemon("--idle-timeout", "300")
    client = processes.client()
    client.take_control()
    client.open_session(processes.protocol, processes.session)
    attempt = let_fall(lambda work: work(client))
    client.collect(1, attempt)
    client.close()
    refused(SessionError, "no session is open", getattr, client, "session")
    for path in processes.folder.glob("session*"):
        path.unlink()
    elsewhere = processes.folder.rename(processes.folder.with_name(f"gone-{os.getpid()}"))
    try:
        told = ended(processes, 2)
    finally:
        elsewhere.rename(processes.folder)
    saved = state / "session.saved-1"
    assert f"everything is saved as {saved}" in told
    assert f"everything is saved as {saved}" in (state / "daemon.log").read_text("utf-8")
    with Session.open(saved, readonly=True) as session:
        assert session.drop(1, attempt) is not None


def test_a_name_that_no_disk_takes_is_refused_with_its_place(processes, caplog):
    with working(processes) as (_, ask):
        for which, length in product(("session", "protocol"), (250, 300)):
            names = {"protocol": str(processes.protocol), "session": str(processes.session)}
            names[which] = str(processes.folder / (length * "x"))
            error = refused(RigError, "", ask, lambda rig, names=names: rig.open_session(**names))
            assert error.exit_code == 2
            assert names[which][:50] in str(error)
    assert not [record for record in caplog.records if record.exc_info]
