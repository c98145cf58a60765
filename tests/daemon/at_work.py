"""A daemon's worker inside the test's own process."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from bench.process_fixture import ProcessFixture
from rig.daemon.lease import Lease
from rig.daemon.worker import Worker
from rig.link.messages import RefusalReason
from rig.link.refusals import DeviceRefusedError
from rig.recorder.published import PublishedState
from tests.waiting import PATIENCE_S


def ended(processes: ProcessFixture, code: int = 0) -> str:
    """Wait until the daemon has ended, with a code and no traceback, and give what it said."""
    _, told = processes.daemon.communicate(timeout=PATIENCE_S)
    assert processes.daemon.returncode == code, told
    assert "Traceback" not in told
    assert code or told.endswith("rig daemon: ended\n")
    return told


def let_fall(ask: Callable[..., Any], run: int = 1) -> int:
    """Arm and fire; again where a starved board has disarmed itself. Returns the attempt."""
    for attempt in range(1, 100):
        try:
            ask(lambda controller, at=attempt: controller.fire(controller.arm(run, at)))
        except DeviceRefusedError as refusal:
            if refusal.reason is not RefusalReason.NOT_ARMED:
                raise
            ask(lambda controller: controller.stop("disarmed by itself"))
        else:
            return attempt
    raise AssertionError("the board never stays armed")


@contextmanager
def working(processes: ProcessFixture) -> Iterator[tuple[Worker, Callable[..., Any]]]:
    """Have a worker at a board, with a session open, and a way to ask it; control never lapses."""
    lease = Lease(lambda: 0.0)
    lease.take("me", "a test")
    worker = Worker(str(processes.port), PublishedState(), lease)
    worker.start()

    def ask(work: Callable[..., Any]) -> Any:
        return worker.submit(work, "me", writes=True).result(PATIENCE_S)

    try:
        files = str(processes.protocol), str(processes.session)
        ask(lambda controller: controller.open_session(*files))
        yield worker, ask
    finally:
        worker.end()
        worker.join()
