"""A STOP that comes while the worker looks whether there is one is not lost."""

from __future__ import annotations

from types import SimpleNamespace

from rig.daemon.lease import Lease
from rig.daemon.worker import Worker
from rig.recorder.published import PublishedState


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
