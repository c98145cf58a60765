"""``rig run``."""

from __future__ import annotations

import sys
from argparse import Namespace
from pathlib import Path

from rig.commands.narration import narrator
from rig.commands.output import GO_ON, goes_on, print_results
from rig.recorder.interrupts import Interrupts
from rig.report.finding import finding
from rig.report.templates import sentence
from rig.runner import run_protocol
from rig.streams import ask, say


def main(arguments: Namespace) -> int:
    """Carry out a protocol."""
    attended = not arguments.yes and sys.stdin.isatty()
    operator = narrator(arguments.protocol, _ask if attended else None)
    interrupts = Interrupts()
    with goes_on("the same command continues the session"), interrupts.caught():
        outcome = run_protocol(
            arguments.protocol,
            arguments.port,
            arguments.session,
            operator,
            arguments.seed,
            interrupts,
            None if arguments.socket is None else Path(arguments.socket),
        )
        code = print_results(outcome, as_json=arguments.json)
    say(f"session: {arguments.session}")
    say(f"{sentence('counted', outcome.analysis)}." if outcome.blind else finding(outcome.analysis))
    return code


def _ask(request: str) -> None:
    ask(f"{request}\n{GO_ON}")
