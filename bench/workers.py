"""Worker processes that end with the bench: after the last result, by Ctrl-C or by SIGTERM."""

from __future__ import annotations

import os
import signal
import sys
from multiprocessing import get_context
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence


def results(calls: Sequence[tuple[Any, ...]], jobs: int | None) -> Iterator[Any]:
    """Call functions in worker processes.

    Parameters
    ----------
    calls
        A function and its arguments each.
    jobs
        Processes at a time; as many as there are processors if not given.

    Yields
    ------
    object
        What each call returns, in the order of the calls.
    """
    before = signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
    try:
        with get_context("spawn").Pool(jobs, _lead_group) as pool:
            waiting = [pool.apply_async(work, inputs) for work, *inputs in calls]
            for result in waiting:
                yield result.get()
    finally:
        signal.signal(signal.SIGTERM, before)


def _lead_group() -> None:
    """Lead a process group: the simulation that a worker started ends with the worker."""
    os.setpgrp()
    signal.signal(signal.SIGTERM, lambda *_: os.killpg(0, signal.SIGKILL))
