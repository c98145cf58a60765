"""Ctrl-C that waits where an exception would do harm."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def ctrl_c_goes_to(handler: Callable[[int, FrameType | None], object]) -> Iterator[None]:
    """Have Ctrl-C handled so in a block, where this thread has it and nobody ignores it."""
    before = signal.getsignal(signal.SIGINT)
    if not callable(before) or threading.current_thread() is not threading.main_thread():
        yield
        return
    try:
        signal.signal(signal.SIGINT, handler)
        yield
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def ctrl_c_waits() -> Iterator[None]:
    """Keep Ctrl-C waiting until the end of a block.

    An exception that strikes where a library calls back from C++ ends the process, and in the
    callback of a weak reference it is shown and lost.
    """
    before, came = signal.getsignal(signal.SIGINT), list["FrameType | None"]()
    try:
        with ctrl_c_goes_to(lambda _number, frame: came.append(frame)):
            yield
    finally:
        if came and callable(before):
            before(signal.SIGINT, came[0])
