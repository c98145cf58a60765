"""Signals that somebody else obeys, and Ctrl-C that waits where an exception would do harm."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def signals_go_to(
    handler: Callable[[int, FrameType | None], object], *numbers: signal.Signals
) -> Iterator[None]:
    """Have signals handled so in a block, in the main thread, but for those that are ignored.

    A shell starts what runs in the background with Ctrl-C ignored, and means it.
    """
    before = {
        number: signal.signal(number, handler)
        for number in numbers
        if signal.getsignal(number) not in {signal.SIG_IGN, None}
    }
    try:
        yield
    finally:
        for number, earlier in before.items():
            signal.signal(number, earlier)


@contextmanager
def ctrl_c_waits() -> Iterator[None]:
    """Keep Ctrl-C, where this thread has it, waiting until the end of a block.

    An exception that strikes where a library calls back from C++ ends the process, and in the
    callback of a weak reference it is shown and lost.
    """
    came: list[int] = []
    is_ours = threading.current_thread() is threading.main_thread()
    try:
        with signals_go_to(lambda number, _: came.append(number), *[signal.SIGINT] * is_ours):
            yield
    finally:
        for number in came[:1]:
            signal.raise_signal(number)
