"""A drop in words: what it measured, beside the model and free fall."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from textual.content import Content

from rig.analysis.comparison import compare
from rig.analysis.result import GOOD, Measured
from rig.measurands import RELEASE_SKEW, SEPARATION, averaged, listed
from rig.predictions import predicted_run
from rig.report.numbers import fixed, plus_minus
from rig.tui.looks import LOOKS
from rig.tui.motion import model_fall
from rig.tui.widgets.text import plain

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rig.analysis.result import DropResult
    from rig.protocol.protocol import Protocol, Run
    from rig.records import Job
    from rig.results.live import SessionView
    from rig.units import Quantity


def stated(model: Quantity) -> Measured | float:
    """Take a prediction as a measured value is written: with U95 where it has any."""
    return Measured(model.value, model.u) if model.u else model.value


def expected_words(protocol: Protocol, run: Run) -> str:
    """State the model's prediction for a run; empty where it has no answer."""
    expected = predicted_run(protocol, run)
    values = [
        f"{row.symbol} {plus_minus(stated(expected[row.name]), row.scale)} {row.unit}"
        for row in averaged()
        if row.name in expected
    ]
    return "  ".join(values)


def sentence(view: SessionView, job: Job) -> str:
    """Say the drop's main result beside what the model expects; empty where there is none."""
    result, run = view.results[job], view.plan[job.run]
    row = next((row for row in averaged() if row.name in result.quantities), None)
    if row is None:
        return ""
    measured = result.quantities[row.name]
    expected = predicted_run(view.protocol, run).get(row.name)
    beside = "" if expected is None else f"; model {plus_minus(stated(expected), row.scale)}"
    fall = model_fall(view.protocol, run, "free")
    if row != SEPARATION or run.impact is None or run.free is None or fall is None:
        return f"{row.symbol} = {plus_minus(measured, row.scale)} {row.unit}{beside}"
    size = Measured(abs(measured.value), measured.u)
    length = view.protocol.chains[run.free].chain.length
    lead = np.diff(fall.times(np.array([measured.value - length, -length])))[0]
    wins = f"{plain(run.impact, 20)} {'wins' if lead > 0.0 else 'loses'}"
    return (
        f"{wins} by {plus_minus(size, row.scale)} {row.unit}{beside}. "
        f"That is {abs(lead) * 1e3:.0f} ms of free fall."
    )


def past_runs(view: SessionView, job: Job, width: int) -> Content:
    """Write the latest drops up to one in a line: run, verdict and main result of each."""
    parts: list[Content] = []
    used = len("past runs")
    for drop in reversed(view.jobs[: view.jobs.index(job) + 1]):
        result = view.results[drop]
        row = next((row for row in averaged() if row.name in result.quantities), None)
        value = "" if row is None else f" {result.quantities[row.name].value * row.scale:.4g}"
        symbol, color = LOOKS.get(result.verdict, ("?", "$foreground"))
        part = Content.assemble(f"  {drop.run}", (symbol, color), value)
        used += len(part)
        if used > width:
            break
        parts.insert(0, part)
    return Content.assemble(("past runs", "$foreground 70%"), *parts)


def number_table(view: SessionView, job: Job, width: int) -> Content:
    """Write the numbers with U95, one a line, in as many columns as there is room for.

    Alone is what the drop says by itself, together what it says in the joint fit of the session.
    """
    result = view.results[job]
    joint = next((drop for drop in view.analysis.runs if (drop.run.number, drop.attempt) == job),
                 None)  # fmt: skip
    joint = joint if view.fitted and joint is not None and joint.verdict in GOOD else None
    head = ["± U95", "alone", *(["together"] if joint else []), "model", "Eₙ"]
    table = [head, *_rows(view, job, joint)]
    widths = [max(len(row[at]) for row in table if at < len(row)) for at in range(len(head))]
    while len(widths) > 2 and sum(widths) + 2 * len(widths) > width:
        widths.pop()
    lines = ["  ".join([row[0].ljust(widths[0]), *map(str.rjust, row[1:], widths[1:])]).rstrip()
             for row in table]  # fmt: skip
    for gate in result.gates:
        interval = "" if gate.interval is None else f", {plus_minus(gate.interval, 1e3)} ms later"
        lines.append(f"gate {gate.channel}: {plus_minus(gate.speed, 1.0)} m/s{interval}")
    counts = " · ".join(f"{count} {kind}" for kind, count in result.audit.json().items())
    bold = Content.styled(lines[0], "bold")
    return Content("\n").join([bold, *map(Content, lines[1:]), Content(f"edges: {counts}")])


def _rows(view: SessionView, job: Job, joint: DropResult | None) -> Iterator[list[str]]:
    """Cells of each number: label, alone, together where there is a joint fit, model, Eₙ."""
    result = view.results[job]
    expected = predicted_run(view.protocol, view.plan[job.run])
    errors = {row.quantity: row.differences[0].normalized_error
              for row in compare(view.protocol, [[result]])}  # fmt: skip
    for row in listed():
        if row.name not in result.quantities:
            continue
        model = expected.get(row.name)
        beside = "" if model is None else plus_minus(stated(model), row.scale)
        if row == RELEASE_SKEW:
            beside = f"limit ±{view.protocol.accept.release_skew * row.scale:g}"
        results = [result, *([joint] if joint else [])]
        values = [plus_minus(drop.quantities[row.name], row.scale) for drop in results
                  if row.name in drop.quantities]  # fmt: skip
        error = fixed(errors.get(row.name), 2) if model is not None else ""
        yield [f"{row.label} ({row.unit})", *values, beside, error]
