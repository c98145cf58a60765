"""A daemon's worker inside the test's own process."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from rig.daemon.lease import Lease
from rig.daemon.worker import Worker
from rig.recorder.published import PublishedState
from tests.waiting import PATIENCE_S

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from bench.process_fixture import ProcessFixture


@contextmanager
def working(processes: ProcessFixture) -> Iterator[tuple[Worker, Callable[..., Any]]]:
    """Have a worker at a board, with a session open, and a way to ask it; control never lapses."""
    lease = Lease(lambda: 0.0)
    lease.take("me", "a test")
    worker = Worker(str(processes.port), PublishedState(), lease)
    worker.start()

    def ask(work: Callable[..., Any]) -> Any:
        return worker.submit(work, "me").result(PATIENCE_S)

    try:
        ask(
            lambda controller: controller.open_session(
                str(processes.protocol), str(processes.session)
            )
        )
        yield worker, ask
    finally:
        worker.end()
        worker.join()
