"""STOP leaves for the board whatever holds the worker up, and all are told what is not known."""

import sqlite3
from contextlib import closing, suppress
from pathlib import Path

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
