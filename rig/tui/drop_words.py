"""A drop in words: its run, and its results with the model and free fall for comparison."""

from dataclasses import replace

from rig.measurands import SEPARATION, averaged
from rig.predictions import predicted_run
from rig.printable import one_line
from rig.protocol.protocol import Protocol, Run
from rig.records import Job
from rig.report.numbers import plus_minus
from rig.report.parts import tables
from rig.results.live import SessionView
from rig.text_rows import read_rows
from rig.text_table import text_table

LOOKS = {name: (sign, colour) for name, sign, colour in read_rows(__file__)}
"""Sign and colour of each verdict and state of a drop."""
_PAST = 6
"""Number of drops in the strip of past runs, to fit 80 columns."""


def headline(run: Run, total: int, attempt: int) -> str:
    """Return the headline of a run: number, attempt, incline and striking chain."""
    again = f" · attempt {attempt}" if attempt > 1 else ""
    strikes = f"chain {one_line(run.impact, 20)} strikes" if run.impact else ""
    head = f"Run {run.number} of {total}{again}"
    return " · ".join(filter(None, (head, one_line(run.set_up, 40), strikes)))


def expected_words(protocol: Protocol, run: Run) -> str:
    """Return the model's prediction for a run in words; empty without a prediction."""
    expected = predicted_run(protocol, run)
    values = ((row, plus_minus(expected[row.name], row.scale)) for row in averaged(expected))
    return "  ".join(f"{row.symbol} {value} {row.unit}" for row, value in values)


def sentence(view: SessionView, job: Job) -> str:
    """Return the drop's main result with the model's value in words; empty without a result."""
    result, run = view.results[job], view.plan[job.run]
    row = next(averaged(result.quantities), None)
    if row is None:
        return ""
    measured = result.quantities[row.name]
    expected = predicted_run(view.protocol, run).get(row.name)
    beside = "" if expected is None else f"; model {plus_minus(expected, row.scale)}"
    size = plus_minus(replace(measured, value=abs(measured.value)), row.scale)
    if row == SEPARATION and run.impact is not None:
        wins = "wins" if measured.value > 0.0 else "loses"
        return f"{one_line(run.impact, 20)} {wins} by {size} {row.unit}{beside}"
    return f"{row.symbol} = {size} {row.unit}{beside}"


def past_runs(view: SessionView, job: Job) -> str:
    """Return a line of the latest drops up to `job`: run, verdict and main result of each."""
    parts, unit = [], ""
    for drop in view.jobs[: view.jobs.index(job) + 1][-_PAST:]:
        result = view.results[drop]
        row = next(averaged(result.quantities), None)
        value = "" if row is None else f" {result.quantities[row.name].value * row.scale:.4g}"
        unit = unit if row is None else f" ({row.unit})"
        parts.append(f"{drop.run} {LOOKS[result.verdict][0]}{value}")
    return f"past runs{unit}  {' · '.join(parts)}"


def number_table(view: SessionView, job: Job) -> str:
    """Return a table of a drop's results, a line each.

    "Alone" is the result of the drop by itself, "together" that of the session's joint fit.
    """
    runs = view.analysis.runs if view.fitted else ()
    joint = (drop for drop in runs if (drop.run.number, drop.attempt) == job)
    results = dict(zip(("alone", "together"), (view.results[job], *joint), strict=False))
    lines = []
    for part in tables("runs", results.values()):
        names = [name for name, _ in part.head]
        lines += text_table([["", *results], *zip(names, *part.rows, strict=True)], left={0})
        lines += part.sentences
    expected = expected_words(view.protocol, view.plan[job.run])
    lines += [f"model  {expected}"] * bool(expected)
    return "\n".join(lines)
