"""``rig run``."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from rig.commands.output import goes_on, print_results, say
from rig.protocol import reader
from rig.recorder.interrupts import Interrupts
from rig.report.finding import finding
from rig.runner import Operator, run_protocol

if TYPE_CHECKING:
    from argparse import Namespace


def main(arguments: Namespace) -> int:
    """Carry out a protocol."""
    attended = not arguments.yes and sys.stdin.isatty()
    operator = _operator(arguments.protocol, attended=attended)
    interrupts = Interrupts()
    with goes_on("the same command goes on from here"), interrupts.caught():
        found = run_protocol(
            arguments.protocol,
            arguments.port,
            arguments.session,
            operator,
            arguments.seed,
            interrupts,
            None if arguments.socket is None else Path(arguments.socket),
        )
        code = print_results(found, as_json=arguments.json)
    say(f"session: {arguments.session}")
    say(finding(found.analysis))
    return code


def _operator(source: str, *, attended: bool) -> Operator:
    """Narrate by a picture where it can be drawn and there is one, or else by lines."""
    ask = _ask if attended else None
    if not sys.stderr.isatty() or sys.stderr.encoding.lower() != "utf-8":
        return Operator(say, ask)
    protocol = reader.read(source)
    if protocol.surface is None or protocol.blind or os.environ.get("TERM") == "dumb":
        return Operator(say, ask)
    from rig.commands.growing import Growing  # noqa: PLC0415 - only where somebody looks

    screen = Growing(protocol, sys.stderr)
    return Operator(screen.say, screen.ask if attended else None, screen.judged)


def _ask(request: str) -> None:
    print(f"{request}\n  then press Enter (Ctrl-C stops, the same command goes on) ", end="",
          file=sys.stderr, flush=True)  # fmt: skip
    if not sys.stdin.readline():
        raise KeyboardInterrupt
