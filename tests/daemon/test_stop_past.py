"""STOP leaves for the board whatever holds the worker up, and all are told what is not known."""

import sqlite3
from contextlib import closing, suppress
from pathlib import Path
from types import SimpleNamespace

from rig.daemon.lease import Lease
from rig.daemon.worker import Worker
from rig.errors import DeviceTimeoutError
from rig.link.messages import CODES, Abort, Disarmed, DisarmReason, Done, Phase
from rig.recorder.controller import Controller
from rig.recorder.published import PublishedState
from rig.session.schema import RunState
from tests.cli.lab import drops_of, frames_of
from tests.link.talk import framed
from tests.waiting import PATIENCE_S, until


def test_stop_goes_past_a_disk_that_does_not_answer(processes, driver, client):
    two = client("two")
    driver.arm(1, 1)
    processes.await_phase(Phase.ARMED)
    seen = []
    with closing(sqlite3.connect(processes.session, PATIENCE_S, isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")  # for 2 s each of the daemon's writes waits for this
        until(lambda: two.call("renew")["disk_s"] > 0.0)
        with suppress(DeviceTimeoutError):
            two.stop("under a disk that does not answer")

        def trouble():
            state = two.call("subscribe")["state"]
            seen.append((state["error"] or {}).get("message", ""))
            return "not known meanwhile" in seen[-1] and state["phase"] == "trouble"

        until(trouble, lambda: seen[-5:])
        other.execute("ROLLBACK")
    until(lambda: two.call("subscribe")["state"]["error"] is None)
    driver.stop("and again, with a disk that does")

    def said(*what):  # a direction, a message, and which request it is or answers
        frames = frames_of(processes.session)
        return what in {(way, f.type, f.seq if way == "tx" else f.ack) for way, f in frames}

    # Where nothing is armed any more, what was said is on the disk some seconds later.
    until(lambda: said("tx", CODES[Abort], 255))
    until(lambda: said("rx", CODES[Done], 255))
    assert drops_of(processes.session) == []


def test_a_stop_between_the_look_and_the_answer_is_kept(monkeypatch):
    worker = Worker("sim://", PublishedState(), Lease())  # never started: this thread is its thread
    worker.controller.recorder = SimpleNamespace(armed=(1, 1))
    late = []

    def held(self):
        if not late:
            late.append(self.stop("a second client"))
        return True

    monkeypatch.setattr(Worker, "_held", property(held))
    worker._attend()
    assert not late[0].done()
    stopped = []
    monkeypatch.setattr(worker.controller, "stop", stopped.append)
    worker._attend()
    assert stopped == ["a second client"]
    assert late[0].done()
    assert worker._attended.is_set(), "no ABORT follows that could end what is armed anew"


def test_a_board_that_disarms_itself_as_soon_as_it_is_armed_is_heard(tmp_path, monkeypatch):
    controller = Controller("sim://", PublishedState())
    ball = Path(__file__).parents[2] / "protocols/falling-ball.yaml"
    controller.open_session(str(ball), str(tmp_path / "a.session"), 1)
    device = controller.recorder.device
    line = framed(Disarmed(1, DisarmReason.STOPPED))  # read together with ARMED
    monkeypatch.setattr(device, "arm", lambda _: len(device._feed("rx", 0, line)))
    controller.arm(1, 1)
    controller.notice()
    assert controller.session.latest_state(1).state is RunState.INTERRUPTED
    controller.close()
