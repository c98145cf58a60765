"""A STOP that comes while the worker looks whether there is one is not lost."""

from __future__ import annotations

from types import SimpleNamespace

from rig.daemon.hub import Hub
from rig.daemon.lease import Lease
from rig.daemon.worker import Worker


def test_a_stop_between_the_look_and_the_answer_is_kept(monkeypatch):
    worker = Worker("sim://", Hub(), Lease())  # never started: this thread is its thread
    worker.desk.station = SimpleNamespace(armed=(1, 1))
    late = []

    def held(self):
        if not late:
            late.append(self.stop("a second client"))
        return True

    monkeypatch.setattr(Worker, "_held", property(held))
    worker._attend()
    assert not late[0].done()
    stopped = []
    monkeypatch.setattr(worker.desk, "stop", stopped.append)
    worker._attend()
    assert stopped == ["a second client"]
    assert late[0].done()
