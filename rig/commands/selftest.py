"""``rig selftest``."""

from __future__ import annotations

from argparse import Namespace
from contextlib import closing, nullcontext

from rig.commands.output import print_findings, say
from rig.errors import DeviceError
from rig.link.port import open_port, port_clock
from rig.protocol import reader
from rig.reasons import remedies
from rig.selftest.board import SelftestOptions
from rig.selftest.findings import Verdict
from rig.selftest.run import selftest
from rig.usb.listing import note_early_boards


def main(arguments: Namespace) -> int:
    """Make all checks, one line each, then say what to do about those that failed."""
    gates = arguments.gates
    if arguments.protocol is not None:
        protocol = reader.read(arguments.protocol)
        gates = (gates or 0) | (protocol.gates.mask if protocol.gates else 0)
    release = arguments.release or arguments.judge is not None
    options = SelftestOptions(arguments.loopback, arguments.drops, release, gates)
    if options.release:
        say("releases will be driven: keep clear of them")
    for note in note_early_boards(arguments.port, arguments.judge):
        say(note)
    judge_port = closing(open_port(arguments.judge)) if arguments.judge else nullcontext()
    with closing(open_port(arguments.port)) as port, judge_port as judge:
        checks = selftest(port, port_clock(port), options, judge)
        findings = print_findings(
            "checks", checks, lambda finding: finding.line, as_json=arguments.json
        )
    failures = sum(finding.verdict is Verdict.FAILED for finding in findings)
    for advice in remedies(finding.reason for finding in findings if finding.reason):
        say(f"do: {advice}")
    if failures:
        say(f"{failures} check{'s' * (failures > 1)} failed")
    return DeviceError.exit_code if failures else 0
