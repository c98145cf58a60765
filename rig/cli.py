"""The ``rig`` command: reads the command line, then loads only what the sub-command needs."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Sequence
from importlib import import_module
from types import FrameType
from typing import TYPE_CHECKING

from rig.command_page import first_answer, first_help
from rig.errors import RigError
from rig.streams import open_streams, say, settle_streams

if TYPE_CHECKING:
    from rig.command_help import Parser

BAD_INPUT = 2
INTERRUPTED = 130
OPTIONAL = ("distributed", "minisign", "mpmath", "weasyprint")
"""Packages that few need: clusters for `rig sweep`, signatures, 50 digits for some of `rig bench`,
a report as PDF."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code.

    0 done, 2 bad input, 3 a run was void, 4 device trouble, 130 interrupted; 1 if a replay differs,
    and from `rig.__main__` after an exception that is raised here. Results go to stdout, everything
    else to stderr.
    """
    open_streams()
    try:
        return _run(argv)
    finally:
        settle_streams()


def _run(argv: Sequence[str] | None) -> int:
    if "_ARGCOMPLETE" in os.environ:  # a shell asks what may follow; this does not return
        import argcomplete  # noqa: PLC0415 - nobody else needs it

        argcomplete.autocomplete(_parser())
    struck: list[object] = []
    try:
        # A stream that is closed is `None`.
        seen = all(stream and stream.isatty() for stream in (sys.stdin, sys.stdout))
        return _carry_out((sys.argv[1:] if argv is None else [*argv]) or ["tui"] * seen, struck)
    except RigError as error:
        say(str(error))
        return error.exit_code
    except (KeyboardInterrupt, Exception) as error:
        # What Ctrl-C strikes may end otherwise: a class in the making turns it into a RuntimeError,
        # and a module half loaded lacks what others look for.
        if not struck and not isinstance(error.__cause__ or error, KeyboardInterrupt):
            return _refusal(error)
        # A command that has something to say of what comes next raises it with these words.
        words = error.args if isinstance(error, KeyboardInterrupt) else ()
        say("; ".join(["rig: interrupted", *map(str, words)]))
        # Where it struck while a module made a class from text, Python 3.11 would end by the signal
        # in spite of all; text that runs to its end makes it forget.
        exec("")  # noqa: S102
        return INTERRUPTED


def _carry_out(words: list[str], struck: list[object]) -> int:
    """Run the command that words name; `struck` grows with each Ctrl-C meanwhile."""
    if answer := first_answer(words):
        print(answer, end="", flush=True)
        return 0
    try:
        arguments = _parser(words).parse(words)
    finally:
        sys.stdout.flush()  # of --help, here, where a closed pipe is understood
    if "place" not in arguments:
        say(first_help(), end="")
        return BAD_INPUT
    from rig.ctrl_c import signals_go_to  # noqa: PLC0415 - `rig --help` needs none of it

    def strike(number: int, frame: FrameType | None) -> None:
        struck.append(frame)
        signal.default_int_handler(number, frame)

    module, _, function = arguments.place.partition(".")
    command = getattr(import_module(f"rig.commands.{module}"), function)
    with signals_go_to(strike, signal.SIGINT):
        code: int = command(arguments) or 0
        sys.stdout.flush()
    return code


def _refusal(error: BaseException) -> int:
    """Say what the system refused, and return the exit code; raise a fault of the program."""
    if isinstance(error, BrokenPipeError):
        return 0  # whoever read our output has seen enough
    if isinstance(error, ModuleNotFoundError):
        package = (error.name or "").partition(".")[0]
        if package in OPTIONAL:
            from shlex import quote  # noqa: PLC0415 - never needed otherwise

            name = "py-minisign" if package == "minisign" else package
            say(f"rig: this needs {name}: {quote(sys.executable)} -m pip install {name}")
            return BAD_INPUT
    if not isinstance(error, OSError):
        raise error
    named = error.strerror and error.filename
    say(f"rig: {error.filename}: {error.strerror}" if named else f"rig: {error}")
    return BAD_INPUT


def _parser(words: Sequence[str] = ()) -> Parser:
    from rig.command_help import build_parser  # noqa: PLC0415 - `rig --help` needs none of it
    from rig.commands.kinds import KINDS  # noqa: PLC0415 - likewise

    return build_parser(KINDS, words)
