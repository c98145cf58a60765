"""STOP leaves for the board whatever holds the worker up, and all are told what is not known."""

from __future__ import annotations

import sqlite3
import threading
from contextlib import closing, suppress

from rig.daemon.stopper import Stopper
from rig.errors import DeviceTimeoutError
from rig.link.frames import Decoder
from rig.link.messages import CODES, HOST_SILENCE_MS, Abort, Done, Phase
from rig.session.store import Session
from tests.waiting import PATIENCE_S, until


def frames(session, direction):
    decoder = Decoder()
    return [
        frame
        for chunk in session.byte_log()
        if chunk.direction == direction
        for frame in decoder.feed(chunk.data)
    ]


def test_without_a_worker_all_five_leave_before_the_board_switches_itself_off(monkeypatch):
    """It would by then, and a later one could only end what somebody armed anew."""
    paused, sent = [], threading.Semaphore(0)
    stopper = Stopper(lambda: sent.release() or True)
    monkeypatch.setattr(stopper._taken_over, "wait", paused.append)
    stopper.start()
    stopper.ask()
    for _ in range(5):
        assert sent.acquire(timeout=PATIENCE_S)
    until(lambda: len(paused) == 5)
    stopper.end()
    assert 0.0 < sum(paused) < HOST_SILENCE_MS * 1e-3


def test_stop_goes_past_a_disk_that_does_not_answer(processes, client):
    one, two = client("one"), client("two")
    one.take_control()
    one.open_session(str(processes.protocol), str(processes.session))
    one.arm(1, 1)
    processes.await_phase(Phase.ARMED)
    seen = []
    with closing(sqlite3.connect(processes.session, PATIENCE_S, isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")  # for 2 s each of the daemon's writes waits for this
        until(lambda: two.call("renew")["disk_s"] > 0.0)
        with suppress(DeviceTimeoutError):
            two.stop("under a disk that does not answer")

        def told():
            state = two.call("subscribe")["state"]
            seen.append((state["error"] or {}).get("message", ""))
            return "not known meanwhile" in seen[-1] and state["phase"] == "trouble"

        until(told, lambda: seen[-5:])
        other.execute("ROLLBACK")
    until(lambda: two.call("subscribe")["state"]["error"] is None)
    one.stop("and again, with a disk that does")
    with Session.open(processes.session, readonly=True) as session:
        # Where nothing is armed any more, what was said is on the disk some seconds later.
        until(lambda: any(f.seq == 255 and f.type == CODES[Abort] for f in frames(session, "tx")))
        until(lambda: any(f.ack == 255 and f.type == CODES[Done] for f in frames(session, "rx")))
        assert session.drop(1, 1) is None
