"""stdout and stderr: closed, full or read by nobody any more, they never change an exit code."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from io import TextIOWrapper
from typing import TextIO

from rig.printable import printable


def open_streams() -> None:
    """Give a closed stdout or stderr a place to go, and an old terminal ``?`` for a Δ it lacks."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            nowhere = os.open(os.devnull, os.O_WRONLY)
            setattr(sys, name, os.fdopen(nowhere, "w", encoding="utf-8", closefd=False))
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")


def settle_streams() -> None:
    """Write out what still waits in stdout and stderr, or let it vanish."""
    for stream in (sys.stdout, sys.stderr):
        with tolerate_broken(stream):
            stream.flush()


def say(line: str, end: str = "\n") -> None:
    """Tell the user something that is no result: a campaign goes on when nobody listens."""
    with tolerate_broken(sys.stderr):
        print(printable(line), end=end, file=sys.stderr, flush=True)


def ask(question: str) -> str:
    """Ask whoever sits at the keyboard, and return the answer.

    Raises
    ------
    KeyboardInterrupt
        Nobody will answer: the input has ended.
    """
    say(question, end="")
    line = sys.stdin.readline()
    if not line:
        raise KeyboardInterrupt
    return line.strip()


@contextmanager
def tolerate_broken(stream: TextIO) -> Iterator[None]:
    """Point a stream that cannot be written at nothing.

    What could not be written waits in its buffer. Python would try once more as it ends, fail, and
    exit with 120.
    """
    try:
        yield
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
