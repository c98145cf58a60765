"""Whoever started a daemon reads on stderr what became of it, each thing once."""

from rig.daemon.lease import Lease
from rig.daemon.worker import Worker
from rig.errors import RigError
from rig.recorder.published import PublishedState
from tests.refusals import refused
from tests.waiting import PATIENCE_S


def test_a_fault_of_the_program_is_logged_with_its_traceback_once(caplog):
    lease = Lease()
    lease.take("me", "a test")
    worker = Worker("sim://", PublishedState(), lease)
    worker.start()
    try:
        divided = worker.submit(lambda _: 1 / 0, "me", writes=False)
        refused(RigError, "internal error", divided.result, PATIENCE_S)
    finally:
        worker.end()
        worker.join()
    assert [record.exc_info[0] for record in caplog.records] == [ZeroDivisionError]
    assert worker.published.get("error") is None, "no scene, so there is nothing to come back to"
    assert worker.published.get("link")["state"] == "closed"
