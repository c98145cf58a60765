"""Ordered execution of many tasks, in this process or, for long work, in several."""

import multiprocessing
import os
import signal
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from itertools import islice
from multiprocessing import resource_tracker
from threading import Thread
from time import perf_counter
from typing import TypeVar

Task = TypeVar("Task")
Result = TypeVar("Result")

_WORTH_S = 4.0
"""Least remaining work for which further processes save time; each starts with 0.7 s of imports."""
_LOOK = 4  # tasks timed before further processes start
_BATCH = 16  # tasks for each process that are read at once


def do_in_order(
    work: Callable[[Task], Result], tasks: Iterable[Task], total: int, processes: int = 1
) -> Generator[tuple[Task, Result]]:
    """Call `work` for each task, and yield each task with its result, in order.

    Parameters
    ----------
    work
        Function; of module level if other processes may be used.
    tasks
        Tasks, read a batch at a time.
    total
        Number of tasks.
    processes
        Greatest number of processes.
    """
    remaining, began = iter(tasks), perf_counter()
    for number, task in enumerate(remaining, 1):
        yield task, work(task)
        ahead_s = (perf_counter() - began) / number * (total - number)
        if processes > 1 and number >= _LOOK and ahead_s > _WORTH_S:
            break
    else:
        return
    context = multiprocessing.get_context("spawn")
    executor = ProcessPoolExecutor(processes, context, _begin)
    try:
        while batch := list(islice(remaining, _BATCH * processes)):
            with _ctrl_c_held():  # processes start with the first tasks
                # Not map: on close it cancels pending tasks, which fails in a broken pool.
                results = [executor.submit(work, task) for task in batch]
            for task, result in zip(batch, results, strict=True):
                yield task, result.result()
    except BaseException:
        for process in multiprocessing.active_children():  # do not wait for running tasks
            process.kill()
        raise
    finally:
        executor.shutdown()


@contextmanager
def _ctrl_c_held() -> Iterator[None]:
    """Block Ctrl-C in processes while they start: this process ends them, with a short message."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # its start unblocks Ctrl-C
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin() -> None:
    """Make a process end with its parent, however that ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
