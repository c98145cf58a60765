"""``rig selftest``."""

from __future__ import annotations

from contextlib import closing
from typing import TYPE_CHECKING

from rig.commands.output import say
from rig.errors import DeviceError
from rig.link.port import open_port, port_clock
from rig.selftest.board import SelftestOptions
from rig.selftest.run import selftest
from rig.selftest.verdicts import Verdict

if TYPE_CHECKING:
    from argparse import Namespace


def main(arguments: Namespace) -> int:
    """Make all checks, one line each."""
    options = SelftestOptions(arguments.loopback, arguments.drops, arguments.release)
    if options.release:
        say("release 0 will be driven once: keep clear of it")
    with closing(open_port(arguments.port)) as port:
        failed = 0
        for outcome in selftest(port, port_clock(port), options):
            print(outcome, flush=True)
            failed += outcome.verdict is Verdict.FAILED
    if failed:
        say(f"{failed} checks failed" if failed > 1 else "1 check failed")
    return DeviceError.exit_code if failed else 0
