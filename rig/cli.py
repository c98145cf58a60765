"""The ``rig`` command: reads the command line, then loads only what the sub-command needs."""

from __future__ import annotations

import argparse
import math
import os
import re
import signal
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from importlib import import_module
from typing import Any

from rig.boards import GATES
from rig.command_help import Parser, build_parser, runnable
from rig.ctrl_c import ctrl_c_goes_to
from rig.errors import RigError
from rig.ready import find_protocol
from rig.streams import open_streams, say, settle_streams

BAD_INPUT = 2
INTERRUPTED = 130
OPTIONAL = {
    "distributed": "distributed",
    "minisign": "py-minisign",
    "mpmath": "mpmath",
    "weasyprint": "weasyprint",
}
"""Packages that few need, with their names for pip: clusters for `rig sweep`, 50 digits for some of
`rig bench`, a report as PDF, signatures."""


class _ListFormats(argparse.Action):
    """Print the formats of timers' files that are known, and stop."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        rows = import_module("rig.timers.vocabulary").read_rows("formats.txt", "|")
        sys.stdout.writelines(f"{name}: {how}; {example}\n" for name, _, how, example in rows)
        parser.exit()


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
    try:
        seen = sys.stdin.isatty() and sys.stdout.isatty()
        words = (sys.argv[1:] if argv is None else argv) or ["tui"] * seen
        parser = _parser(words)
        try:
            arguments = parser.parse(words)
        finally:
            sys.stdout.flush()  # of --help, here, where a closed pipe is understood
        if "module" not in arguments:
            say(parser.format_help(), end="")
            return BAD_INPUT
        command = import_module(f"rig.commands.{arguments.module}")
        with ctrl_c_goes_to(signal.default_int_handler):
            code: int = command.main(arguments)
            sys.stdout.flush()
    except RigError as error:
        say(runnable(str(error)))
        return error.exit_code
    except (KeyboardInterrupt, RuntimeError) as error:
        # A class in the making turns what strikes it into a RuntimeError.
        if not isinstance(error.__cause__ or error, KeyboardInterrupt):
            raise
        # A command that has something to say of what comes next raises it with these words.
        words = error.args if isinstance(error, KeyboardInterrupt) else ()
        say("; ".join(["rig: interrupted", *map(str, words)]))
        # Where it struck while a module made a class from text, Python 3.11 would end by the signal
        # in spite of all; text that runs to its end makes it forget.
        exec("")  # noqa: S102
        return INTERRUPTED
    except BrokenPipeError:
        return 0  # whoever read our output has seen enough
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package not in OPTIONAL:
            raise
        from shlex import quote  # noqa: PLC0415 - never needed otherwise

        install = f"{quote(sys.executable)} -m pip install {OPTIONAL[package]}"
        say(f"rig: this needs {OPTIONAL[package]}: {install}")
        return BAD_INPUT
    except OSError as error:
        named = error.strerror and error.filename
        say(f"rig: {error.filename}: {error.strerror}" if named else f"rig: {error}")
        return BAD_INPUT
    return code


def _parser(words: Sequence[str] | None = None) -> Parser:
    return build_parser(_KINDS, words)


def _accept(
    accepted: str, read: Callable[[str], Any], holds: Callable[[Any], object]
) -> dict[str, Any]:
    """Return a kind of value; text that cannot be read so, or does not hold, is refused."""

    def convert(text: str) -> object:
        with suppress(ValueError):
            value = read(text)
            if holds(value):
                return value
        raise argparse.ArgumentTypeError(f"found '{text}'; accepted: {accepted}")

    return {"type": convert}


def _place(name: str, text: str) -> str:
    """Read a file's place: in a folder it has this name, else at least its ending."""
    if text.endswith("/") or os.path.isdir(text):  # noqa: PTH112 - pathlib takes 5 ms
        return os.path.join(text, name)  # noqa: PTH118
    named = os.path.splitext(text)[1] or os.path.exists(text)  # noqa: PTH110, PTH122
    return text if named else text + os.path.splitext(name)[1]  # noqa: PTH122


def _quantity(text: str, dimension: str) -> float:
    """Read a quantity; units, with fractions and decimals, are loaded only for one."""
    units = import_module("rig.units")
    return float(units.parse(text, units.Dimension[dimension]).value)


def _socket(name: str) -> str:
    """Return the socket of the daemon of a rig, by the rig's name."""
    return str(import_module("rig.daemon.socket_path").default_socket(_NAME["type"](name)))


_NAME = _accept("letters, digits, - and _", str, re.compile(r"(?a:[\w-]{1,40})").fullmatch)
"""A rig's name, which becomes a part of a file's."""
_KINDS: dict[str, dict[str, Any]] = {
    "int": {"type": int},
    "count": _accept("a whole number, 1 or more", int, lambda n: n >= 1),
    "gates": _accept(
        f"numbers from 0 to {GATES - 1}, with commas between",
        lambda text: sum(1 << channel for channel in set(map(int, text.split(",")))),
        lambda mask: mask < 1 << GATES,
    ),
    "length": _accept(
        "a length above 0, such as 60 mm",
        lambda text: _quantity(text, "LENGTH"),
        lambda metres: metres > 0.0,
    ),
    "name": _NAME,
    "rig": {"dest": "socket", "type": _socket},
    "address": _accept(
        ":8080 for this computer alone, HOST:8080 or 0.0.0.0:8080 for others too",
        lambda text: (text.rpartition(":")[0].strip("[]") or "localhost", int(text.split(":")[-1])),
        lambda address: 0 <= address[1] < 1 << 16,
    ),
    "port": _accept(
        "a device path, or a URL such as sim://, or auto",
        lambda text: import_module("rig.usb.listing").sole_port() if text == "auto" else text,
        bool,
    ),
    "protocol": {"type": find_protocol},
    "text": _accept("words", str, str.strip),
    "seconds": _accept("a time in seconds above 0", float, lambda s: 0.0 < s < math.inf),
    "seed": _accept("a whole number from 0 to 2^63", int, lambda n: 0 <= n < 1 << 63),
    "share": _accept(
        "a share from 0 to 10 %, as in 50 ppm",
        lambda text: _quantity(text, "NUMBER"),
        lambda share: 0.0 <= share < 0.1,
    ),
    "trials": _accept(
        "a whole number or adaptive",
        lambda text: text if text == "adaptive" else int(text),
        lambda trials: trials == "adaptive" or trials >= 1,
    ),
    "file": {"type": _place},
    "formats": {"action": _ListFormats, "nargs": 0},
}
"""Kinds of values that `rig.command_help` names, as argparse takes them."""


if __name__ == "__main__":
    sys.exit(main())
