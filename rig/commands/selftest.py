"""``rig selftest``."""

from contextlib import closing, nullcontext
from pathlib import Path

from rig.commands.output import Arguments, print_findings, say
from rig.errors import DeviceError
from rig.link.port import open_port
from rig.ports import add_settings
from rig.protocol import reader
from rig.selftest.board import SelftestOptions
from rig.selftest.run import selftest


def main(arguments: Arguments) -> int:
    """Make all checks, and say what to do about those that failed."""
    gates, url = arguments.gates, arguments.port
    if arguments.protocol is not None:
        url = add_settings(url, protocol=str(Path(arguments.protocol).resolve()))
        gates = (gates or 0) | reader.read(arguments.protocol).gates.mask
    release = arguments.release or arguments.judge is not None
    options = SelftestOptions(arguments.loopback, arguments.drops, release, gates)
    if options.release:
        say("releases will be driven: keep clear of them")
    judge_port = closing(open_port(arguments.judge)) if arguments.judge else nullcontext()
    with closing(open_port(url)) as port, judge_port as judge:
        checks = selftest(port, options, judge)
        failures = print_findings("checks", checks, as_json=arguments.json)
    if failures:
        say(f"{failures} check{'s' * (failures > 1)} failed")
    return DeviceError.exit_code if failures else 0
