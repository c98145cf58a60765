"""A drop in words: its verdict, and what it measured, beside the model and free fall."""

from __future__ import annotations

from typing import TYPE_CHECKING

from textual.content import Content

from rig.analysis.result import GOOD, Measured
from rig.measurands import SEPARATION, averaged
from rig.predictions import predicted_run
from rig.reasons import remedies
from rig.report.numbers import plus_minus
from rig.report.parts import tables
from rig.text_table import text_table
from rig.tui.widgets.text import plain

if TYPE_CHECKING:
    from rig.protocol.protocol import Protocol, Run
    from rig.records import Job
    from rig.results.live import SessionView
    from rig.tui.model import Model
    from rig.units import Quantity


LOOKS = {
    "accepted": ("✓", "$success"),
    "marginal": ("~", "$warning"),
    "void": ("✗", "$error"),
    "rejected": ("⊘", "$error"),
    "recorded": ("…", "$primary"),
    "armed": ("!", "$warning"),
    "fired": ("↓", "$primary"),
    "interrupted": ("■", "$warning"),
    "planned": ("·", "$foreground 70%"),
}
_PAST = 6
"""Drops in the strip of past runs: as many as fit 80 columns."""
_REMEDIES = 2
"""Things to do that are shown: what else is wrong shows when these are mended."""


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
    size = plus_minus(Measured(abs(measured.value), measured.u), row.scale)
    if row == SEPARATION and run.impact is not None:
        wins = "wins" if measured.value > 0.0 else "loses"
        return f"{plain(run.impact, 20)} {wins} by {size} {row.unit}{beside}"
    return f"{row.symbol} = {size} {row.unit}{beside}"


def past_runs(view: SessionView, job: Job) -> str:
    """Write the latest drops up to one in a line: run, verdict and main result of each."""
    parts = []
    for drop in view.jobs[: view.jobs.index(job) + 1][-_PAST:]:
        result = view.results[drop]
        row = next((row for row in averaged() if row.name in result.quantities), None)
        value = "" if row is None else f" {result.quantities[row.name].value * row.scale:.4g}"
        parts.append(f"{drop.run} {LOOKS[result.verdict][0]}{value}")
    return "past runs  " + " · ".join(parts)


def number_table(view: SessionView, job: Job) -> Content:
    """Write what a drop measured, one number a line, beside what it says with all others.

    Alone is what the drop says by itself, together what it says in the joint fit of the session.
    """
    alone, run = view.results[job], view.plan[job.run]
    joint = (
        drop
        for drop in view.analysis.runs
        if view.fitted and (drop.run.number, drop.attempt) == job
    )
    results = {"alone": alone} | dict(zip(("together",), joint, strict=False))
    lines = []
    for part in tables("runs", results.values()):
        names = [name for name, _ in part.head]
        lines += text_table([["", *results], *zip(names, *part.rows, strict=True)], left={0})
        lines += part.sentences
    expected = expected_words(view.protocol, run)
    lines += [f"model  {expected}"] if expected else []
    return Content("\n".join(lines))


def verdict_words(model: Model) -> Content:
    """Write the verdict and its reasons."""
    verdict, reasons = model.verdict
    if model.job is None or not verdict:
        return Content(model.loading or "No verdict yet.")
    symbol, colour = LOOKS.get(verdict, ("?", "$foreground"))
    lines = [Content.styled(f" {symbol} {verdict.upper()} ", f"bold $background on {colour}")]
    lines += [Content(f"  {plain(reason, 200)}") for reason in reasons[:4]]
    if len(reasons) > 4:
        lines.append(Content("  and more reasons, in the session file"))
    replaced = model.replaced
    if verdict not in GOOD and replaced is not None:
        lines += [
            Content(f"  Only the latest attempt counts: attempt {replaced.attempt} was good, "
                    f"but run {model.job.run} has no result now."),
            Content("  → press a to repeat it before you change anything at the rig"),
        ]  # fmt: skip
    if model.blind:
        lines.append(Content("  BLIND: results are hidden until you unblind the session"))
    if verdict == "void":
        lines += [Content(f"  → {remedy}") for remedy in remedies(reasons)[:_REMEDIES]]
    return Content("\n").join(lines)
