"""``rig run``."""

import sys

from rig.commands.output import Arguments, goes_on, print_results
from rig.report.finding import finding
from rig.report.templates import sentence
from rig.runner import Operator, run_protocol
from rig.streams import ask, say

_GO_ON = "  then press Enter (Ctrl-C stops; the same command continues) "


def main(arguments: Arguments) -> int:
    """Carry out a protocol."""
    is_alone = arguments.yes or not sys.stdin.isatty()
    operator = Operator(say, None if is_alone else lambda request: ask(f"{request}\n{_GO_ON}"))
    with goes_on("the same command continues the session"):
        places = arguments.protocol, arguments.port, arguments.session
        outcome = run_protocol(*places, operator, arguments.seed, arguments.socket)
        code = print_results(outcome, as_json=arguments.json)
    say(f"session: {arguments.session}")
    say(f"{sentence('counted', outcome.analysis)}." if outcome.blind else finding(outcome.analysis))
    return code
