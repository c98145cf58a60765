"""Work on many things: in this process or, where that takes long, on all processors."""

from __future__ import annotations

import multiprocessing
import os
import signal
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from itertools import islice
from multiprocessing import resource_tracker
from threading import Thread
from time import perf_counter
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

Task = TypeVar("Task")
Result = TypeVar("Result")

_WORTH_S = 4.0
"""Work left to do from which other processes, each of which begins with 0.7 s of imports, help."""
_LOOK = 4  # tasks after which is looked how long they take
_BATCH = 16  # tasks for each process that are read at once


def do_in_order(
    work: Callable[[Task], Result],
    tasks: Iterable[Task],
    take: Callable[[Task, Result], None],
    total: int,
    processes: int = 1,
) -> None:
    """Call a function for each task, and take what it returns in the order of the tasks.

    Parameters
    ----------
    work
        Of a module, if other processes may help.
    tasks
        Read a batch at a time.
    total
        Number of tasks.
    processes
        That may be used, where it is worth it.
    """
    remaining, began = iter(tasks), perf_counter()
    for number, task in enumerate(remaining, 1):
        take(task, work(task))
        ahead_s = (perf_counter() - began) / number * (total - number)
        if processes > 1 and number >= _LOOK and ahead_s > _WORTH_S:
            break
    else:
        return
    context = multiprocessing.get_context("spawn")
    executor = ProcessPoolExecutor(processes, context, _begin)
    try:
        while batch := list(islice(remaining, _BATCH * processes)):
            with _ctrl_c_held():  # processes begin with the first tasks
                # Not a map, which cancels what is left as it is closed, and a dead pool says so.
                results = [executor.submit(work, task) for task in batch]
            for task, result in zip(batch, results, strict=True):
                take(task, result.result())
    except BaseException:
        for process in multiprocessing.active_children():  # what they are at is not waited for
            process.kill()
        raise
    finally:
        executor.shutdown()


@contextmanager
def _ctrl_c_held() -> Iterator[None]:
    """Keep Ctrl-C from processes that begin: it is this one that ends them, in a few words."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # which lets Ctrl-C through when it begins
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin() -> None:
    """Have a process end with the one that began it, however that ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
