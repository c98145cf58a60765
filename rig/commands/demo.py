"""``rig demo``: a small simulated session, and its results beside the hidden truth."""

import json
import os
import sys
from datetime import UTC, datetime
from pathlib import Path
from shlex import quote

from rig.analysis.result import GOOD
from rig.analysis.session import Analysis
from rig.commands import report
from rig.commands.output import Arguments, exit_code, goes_on, say
from rig.files import make_folder, write_atomic
from rig.measurands import MEASURANDS
from rig.ports import truth_file
from rig.protocol.reader import parse
from rig.ready import ready_protocol
from rig.report.columns import table_parts
from rig.runner import Operator, run_protocol

_PROTOCOL = "inclined-uniform"
_REPEATS = "repeats: 12 "


def main(arguments: Arguments) -> int:
    """Drop the paper's chains in simulation, and say how well the truth was found."""
    folder = make_folder(arguments.output or f"out/demo-{datetime.now(UTC):%Y%m%dT%H%M%SZ}")
    protocol, session = (folder / f"{_PROTOCOL}.{end}" for end in ("yaml", "session"))
    text = ready_protocol(_PROTOCOL).read_text("utf-8")
    assert _REPEATS in text
    text = text.replace(_REPEATS, f"repeats: {arguments.repeats} ")
    write_atomic(protocol, text)
    drops = len(parse(text).runs())
    say(f"{drops} drops of two chains, {arguments.repeats} at each incline")
    with goes_on(
        f"rig demo -o {quote(str(folder))} --repeats {arguments.repeats} "
        f"--seed {arguments.seed} continues it"
    ):
        places = str(protocol), "sim://", str(session)
        analysis = run_protocol(*places, Operator(say), arguments.seed).analysis
        print("\n".join(["SIMULATED DATA", *beside_truth(analysis, session)]))
        page = folder / "report.html"
        usual = {"bars": "U95", "fresh": False, "estimate": False, "pdf": None}
        code = report.main(Arguments(session=session, output=page, figures=folder, **usual))
    # A browser in a terminal would be in the way.
    has_screen = sys.platform == "darwin" or {"DISPLAY", "WAYLAND_DISPLAY"} & os.environ.keys()
    if arguments.open or (has_screen and sys.stdout.isatty()):
        import webbrowser  # noqa: PLC0415 - only where somebody looks

        webbrowser.open(page.absolute().as_uri())
    say(f"show it: rig tui --session {session}\nyour own set-up: rig new my.yaml")
    return code or exit_code(analysis)


def beside_truth(analysis: Analysis, session: Path) -> list[str]:
    """Write what each good drop measured beside what really happened.

    Parameters
    ----------
    session
        Of a simulation, which keeps its truth beside it.

    Returns
    -------
    list of str
        A table, and how many intervals hold the truth.
    """
    lines = map(json.loads, truth_file(session).read_text("utf-8").splitlines())
    truths = {(truth["run"], truth["attempt"]): truth for truth in lines}
    drops = [
        (result, truths[result.run.number, result.attempt])
        for result in sorted(analysis.runs, key=lambda result: result.run.incline_deg)
        if result.verdict in GOOD and (result.run.number, result.attempt) in truths
    ]
    if not drops:
        return ["no good drop to compare with the truth"]
    agreements = [
        abs(value.value - truth[name]) <= value.expanded
        for result, truth in drops
        for name, value in result.quantities.items()
        if "averaged" in MEASURANDS[name].kinds and name in truth
    ]
    return [
        *(row for part in table_parts("truth", drops) for row in part.table),
        f"{sum(agreements)} of {len(agreements)} results agree with the hidden truth "
        "within ± U (95 % expected)",
    ]
