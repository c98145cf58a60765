"""``rig demo``: a small simulated session, and its results beside the hidden truth."""

from __future__ import annotations

import json
import os
import sys
from argparse import Namespace
from datetime import UTC, datetime
from shlex import quote
from typing import TYPE_CHECKING

from rig.analysis.result import GOOD
from rig.commands import report
from rig.commands.narration import narrator
from rig.commands.output import exit_code, goes_on, say, show
from rig.errors import InputError
from rig.files import make_folder, write_atomic
from rig.measurands import averaged
from rig.ports import truth_file
from rig.protocol.reader import parse
from rig.ready import ready_protocol
from rig.recorder.interrupts import Interrupts
from rig.report.estimate import symbol
from rig.report.numbers import fixed, plus_minus
from rig.results.estimated import session_estimate
from rig.runner import run_protocol
from rig.session.store import Session
from rig.text_table import text_table

if TYPE_CHECKING:
    from pathlib import Path

    from rig.analysis.session import Analysis
    from rig.results import SessionResults

_PROTOCOL = "inclined-uniform"
_REPEATS = "repeats: 12 "


def main(arguments: Namespace) -> int:
    """Drop the paper's chains in simulation, and say how well the truth was found."""
    folder = make_folder(arguments.output or f"out/demo-{datetime.now(UTC):%Y%m%dT%H%M%SZ}")
    protocol, session = (folder / f"{_PROTOCOL}.{end}" for end in ("yaml", "session"))
    text = ready_protocol(_PROTOCOL).read_text("utf-8")
    assert _REPEATS in text
    text = text.replace(_REPEATS, f"repeats: {arguments.repeats} ")
    inclines = len(parse(text).plan.inclines)
    write_atomic(protocol, text)
    say(f"{inclines * arguments.repeats} drops of two chains, {arguments.repeats} at each incline")
    again = (
        f"rig demo -o {quote(str(folder))} --repeats {arguments.repeats} --seed {arguments.seed}"
    )
    with goes_on(f"{again} continues it"):
        return _run_demo(protocol, session, arguments)


def _run_demo(protocol: Path, session: Path, arguments: Namespace) -> int:
    """Let chains fall, or those that have not fallen yet, and show what was found."""
    interrupts = Interrupts()
    with interrupts.caught():
        operator = narrator(str(protocol), None)
        outcome = run_protocol(
            str(protocol), "sim://", str(session), operator, arguments.seed, interrupts
        )
    print("SIMULATED DATA")
    print("\n".join(beside_truth(outcome.analysis, session)))
    with Session.open(session, readonly=True) as recorded:
        show([impacts(recorded, outcome)])
    page = session.with_name("report.html")
    places = {"session": str(session), "output": str(page), "figures": str(page.parent)}
    usual = {"bars": "U95", "fresh": False, "estimate": False, "pdf": None}
    code = report.main(Namespace(**places, **usual))
    # A browser in a terminal would be in the way.
    screens = map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY"))
    has_screen = sys.stdout.isatty() and (sys.platform == "darwin" or any(screens))
    if arguments.open or has_screen:
        import webbrowser  # noqa: PLC0415 - only where somebody looks

        webbrowser.open(page.absolute().as_uri())
    say(f"show it: rig tui --session {session}\nyour own set-up: rig new my.yaml")
    return code or exit_code(outcome.analysis)


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
    rows: list[dict[str, str]] = []
    agreements: list[bool] = []
    for result in analysis.runs:
        true = truths.get((result.run.number, result.attempt))
        if true is None or result.verdict not in GOOD:
            continue
        cells = {"incline (°)": f"{result.run.incline_deg:g}"}
        for row in averaged():
            value, hidden = result.quantities.get(row.name), true.get(row.name)
            if value is None or hidden is None:
                continue
            cells[f"{row.symbol} ± U ({row.unit})"] = plus_minus(value, row.scale, row.decimals)
            cells[f"true {row.symbol}"] = fixed(hidden * row.scale, row.decimals)
            agreements.append(abs(value.value - hidden) <= value.expanded)
        rows.append(cells)
    rows.sort(key=lambda cells: float(cells["incline (°)"]))
    if not rows:
        return ["no good drop to compare with the truth"]
    headings = max(rows, key=len)
    table = [[cells.get(heading, "") for heading in headings] for cells in rows]
    return [
        *text_table([[*headings], *table], rule=True),
        f"{sum(agreements)} of {len(agreements)} results agree with the hidden truth "
        "within ± U (95 % expected)",
    ]


def impacts(session: Session, results: SessionResults) -> str:
    """Say which β and μ the drops tell, beside those that the simulated board has."""
    try:
        coefficients = session_estimate(session, results).coefficients
    except InputError as error:
        return error.message
    parts = [
        f"{symbol(value.name)} {plus_minus(value.least_squares)} (hidden: {value.stated.value:g})"
        for value in (coefficients.parameters if coefficients else ())
        if value.identified
    ]
    return f"from all impacts: {', '.join(parts).replace('-', '−') or 'too few drops'}"
