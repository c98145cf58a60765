"""Who computes: this process, or processes of this machine."""

from __future__ import annotations

import multiprocessing
import os
import signal
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import resource_tracker
from threading import Thread
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

from rig.ctrl_c import ctrl_c_waits
from rig.errors import RigError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

P = ParamSpec("P")
T = TypeVar("T")


class WorkersError(RigError):
    """Those who were to compute cannot be reached or broke off, exit code 4."""

    exit_code = 4


class Inline(Executor):
    """Computes in this process, at the moment of asking."""

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Return a future that is done already."""
        future: Future[T] = Future()
        future.set_result(fn(*args, **kwargs))
        return future


@contextmanager
def processes(jobs: int) -> Iterator[Executor]:
    """Provide that many processes; none is left when the block ends, however it ends.

    Raises
    ------
    WorkersError
        If one of them dies.
    """
    resource_tracker.ensure_running()  # its first start would let Ctrl-C through in `submit`
    pool = _Pool(
        jobs,
        # A copy of a process with threads may hang, so they start afresh.
        mp_context=multiprocessing.get_context("spawn"),
        initializer=_end_with_parent,
    )
    try:
        yield pool
    except BrokenExecutor as error:
        raise WorkersError(
            "a process that computed a part of the sweep died",
            "was there too little memory? try fewer points, or --jobs 1",
        ) from error
    finally:
        pool.shutdown(cancel_futures=True)


def cores() -> int:
    """Return the number of cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class _Pool(ProcessPoolExecutor):
    """A pool whose processes never hear Ctrl-C, which a terminal sends to all of a group."""

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        # Processes start in here and inherit what is blocked, so not even one that is still
        # starting can be hit. This process gets its own signal afterwards: its start of another
        # one must not be torn, and any thread of a library may take a signal for it.
        with ctrl_c_waits():
            before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
            try:
                return super().submit(fn, *args, **kwargs)
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _end_with_parent() -> None:
    """Have this process end when its parent is gone, even one that was killed."""
    parent: Any = multiprocessing.parent_process()

    def watch() -> None:
        parent.join()
        os._exit(1)

    Thread(target=watch, daemon=True).start()
