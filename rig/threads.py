"""Processors, and one thread for linear algebra: with small matrices threads are in the way."""

import os
import threading
from contextlib import ContextDecorator
from functools import cache
from typing import Any


class _OneThread(ContextDecorator):
    """Holds until nobody works within it any more, in whatever thread.

    How many threads multiply is one number for the whole process in most builds of BLAS: whoever
    set it back to what he had found would set it back for others too.
    """

    def __init__(self) -> None:
        self._guard = threading.Lock()
        self._inside = 0
        self._first: Any = None  # knows how it was before anybody came

    def __enter__(self) -> None:
        with self._guard:
            _disown()
            limited = libraries().limit(limits=1, user_api="blas")  # some builds count by thread
            if not self._inside:
                self._first = limited
            self._inside += 1

    def __exit__(self, *_exc: object) -> None:
        with self._guard:
            self._inside -= 1
            if not self._inside:
                _disown()
                self._first.restore_original_limits()
                _disown()


one_thread = _OneThread()
"""Has a function's matrices multiplied by one thread, whoever calls it.

With several, a sum's last digits depend on how busy the machine is, and on two cores the same work
costs twice the processor time. Others' matrices are theirs: the bound ends with the last of all
calls that are under way, in whatever threads.
"""


def processors() -> int:
    """Return the number of processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@cache
def libraries() -> Any:
    """Find the libraries that multiply numpy's matrices; to look takes some milliseconds.

    scipy may bring another one later, which special functions do not use.
    """
    import numpy as np  # noqa: F401, PLC0415 - it is what loads them
    from threadpoolctl import ThreadpoolController  # noqa: PLC0415 - only with numpy

    return ThreadpoolController()


def _disown() -> None:
    """Let any thread set the number: threadpoolctl 3.8 obeys only the one that did so before."""
    for library in libraries().lib_controllers:
        if hasattr(library, "clear_controlling_thread"):
            library.clear_controlling_thread(force=True)
