"""stdout and stderr: closed, full or read by nobody any more, they never change an exit code.

What is said there names commands as this user can run them.
"""

import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from io import TextIOWrapper
from shlex import quote
from typing import TextIO

from rig.command_page import COMMANDS
from rig.printable import printable

_NAMED = rf"(?<![\w/.-])rig (?=(?:{'|'.join(COMMANDS)}|--help)(?![\w:-]))"
"""A command, but not the name that begins a program's own narration, as in ``rig daemon:``."""


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
        print(printable(runnable(line)), end=end, file=sys.stderr, flush=True)


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


def runnable(text: str) -> str:
    """Write each command of a text as this user can run it.

    Before anybody activates the environment of `./run demo`, that is ``.venv/bin/rig check``.
    """
    return re.sub(_NAMED, lambda _: f"{_program()} ", text)


@cache
def _program() -> str:
    from shutil import which  # noqa: PLC0415 - only for what names a command

    installed = os.path.join(os.path.dirname(sys.executable), "rig")  # noqa: PTH118, PTH120
    if which("rig"):
        return "rig"
    if which(installed) is None:
        return f"{quote(sys.executable)} -m rig"
    here = os.path.relpath(installed)
    return quote(installed if here.startswith(os.pardir) else here)


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
