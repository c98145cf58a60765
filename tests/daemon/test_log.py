"""Whoever started a daemon reads on stderr what became of it, each thing once."""

import re
import signal

from bench.process_fixture import ProcessFixture
from rig.daemon.lease import Lease
from rig.daemon.worker import Worker
from rig.errors import RigError
from rig.recorder.published import PublishedState
from tests.daemon.at_work import ended
from tests.refusals import refused
from tests.tables import read_table
from tests.waiting import PATIENCE_S


def test_a_session_and_a_pulled_cable_are_told_once_each():
    with ProcessFixture(runs=2, seed=3) as processes:
        processes.start_daemon()
        told = [processes.daemon.stderr.readline().rstrip()]
        client = processes.client("the driver")
        client.take_control()
        client.open_session(processes.protocol, processes.session)
        client.fire(client.arm(1, 1))
        client.collect(1, 1)
        client.arm(2, 1)
        client.stop("enough")
        processes.hand("pull 1")
        told += [processes.daemon.stderr.readline().rstrip() for _ in range(5)]
        while not told[-1].startswith("up"):
            told.append(processes.daemon.stderr.readline().rstrip())
        client.close_session()
        client.close()
        processes.daemon.send_signal(signal.SIGTERM)
        told += ended(processes).splitlines()
    down = [line for line in told if line.startswith("down: ")]
    assert down
    assert len(set(down)) == len(down)
    expected = read_table(__file__, "log")
    others = [line for line in told if line not in down]
    assert len(others) == len(expected), others
    for line, pattern in zip(others, expected, strict=True):
        assert re.fullmatch(pattern.replace("SESSION", str(processes.session)), line), others


def test_a_fault_of_the_program_is_logged_with_its_traceback_once(caplog):
    lease = Lease()
    lease.take("me", "a test")
    worker = Worker("sim://", PublishedState(), lease)
    worker.start()
    try:
        refused(RigError, "internal error", worker.submit(lambda _: 1 / 0, "me").result, PATIENCE_S)
    finally:
        worker.end()
        worker.join()
    assert [record.exc_info[0] for record in caplog.records] == [ZeroDivisionError]
    assert worker.published.get("error") is None, "no scene, so there is nothing to come back to"
