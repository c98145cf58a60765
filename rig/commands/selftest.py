"""``rig selftest``."""

from __future__ import annotations

from argparse import Namespace
from contextlib import ExitStack, closing

from rig.commands.output import print_json, say
from rig.errors import DeviceError
from rig.link.port import open_port, port_clock
from rig.protocol import reader
from rig.reasons import remedies
from rig.selftest.board import BoardUnderTest, SelftestOptions
from rig.selftest.findings import Verdict
from rig.selftest.judge import Judge
from rig.selftest.run import selftest


def main(arguments: Namespace) -> int:
    """Make all checks, one line each, then say what to do about those that failed."""
    gates = arguments.gates
    if arguments.protocol is not None:
        protocol = reader.read(arguments.protocol)
        gates = (gates or 0) | (protocol.gates.mask if protocol.gates else 0)
    judges = [arguments.judge] if arguments.judge else []
    release = arguments.release or bool(judges)
    options = SelftestOptions(arguments.loopback, arguments.drops, release, gates)
    if judges:
        say("the releases of both boards will be driven: no magnet may be wired")
    elif options.release:
        say("release 0 will be driven once: keep clear of it")
    findings = []
    with ExitStack() as ports:
        port, *others = (
            ports.enter_context(closing(open_port(name))) for name in (arguments.port, *judges)
        )
        judge = [Judge(BoardUnderTest(one, port_clock(one), options)) for one in others]
        for finding in selftest(port, port_clock(port), options, *judge):
            findings.append(finding)
            if not arguments.json:
                words = finding.name, finding.verdict, finding.what
                print(": ".join(filter(None, words)), flush=True)
    if arguments.json:
        print_json({"checks": [finding.json() for finding in findings]})
    failures = sum(finding.verdict is Verdict.FAILED for finding in findings)
    for advice in remedies(finding.reason for finding in findings if finding.reason):
        say(f"do: {advice}")
    if failures:
        say(f"{failures} checks failed" if failures > 1 else "1 check failed")
    return DeviceError.exit_code if failures else 0
