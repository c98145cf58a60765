"""What a report says, chapter by chapter; what a scene does not have is left out."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import partial
from html import escape
from operator import attrgetter
from typing import TYPE_CHECKING, NamedTuple

from rig.analysis.result import GOOD
from rig.measurands import SEPARATION_RAW, averaged
from rig.reasons import remedies, sentences
from rig.report.attachments import link
from rig.report.columns import (
    AUDIT,
    Column,
    Mean,
    fine,
    mean_columns,
    run_columns,
    run_incline,
    summary_columns,
)
from rig.report.embed import embedded
from rig.report.finding import finding, raised
from rig.report.method import METHOD, PAPER, SOFTWARE, method_words
from rig.report.numbers import plus_minus, signed
from rig.report.tables import bullets, paragraphs, scrolling, table

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from rig.analysis.result import DropResult
    from rig.analysis.session import Analysis
    from rig.analysis.summary import Incline
    from rig.measurands import Measurand
    from rig.report.attachments import Attachment
    from rig.report.embed import PageFigure
    from rig.report.html import ReportContext
    from rig.report.parts import Part
    from rig.report.timeline import Timeline

PLACES = ("results", "budget", "impacts", "drops")
"""Chapters that have figures, in the order of the page."""


class Chapter(NamedTuple):
    """A heading, where it is on the page, and what follows it."""

    anchor: str
    heading: str
    html: str


def in_order(figures: Iterable[PageFigure]) -> list[PageFigure]:
    """Sort figures as they stand on the page, which is how they are numbered."""
    return sorted(figures, key=lambda one: PLACES.index(one.place))


def chapters(context: ReportContext) -> list[Chapter]:
    """Return all chapters; the summary is written last, when all failures are known."""
    drafts = [
        Chapter("results", "Results", _results(context)),
        Chapter("budget", "Uncertainty budget", _budget(context)),
        Chapter("impacts", "Impacts", _impacts(context)),
        Chapter("drops", "Drops", _drops(context)),
        Chapter("timelines", "Gate timelines", _timelines(context)),
        Chapter("method", "Method", _method(context)),
        Chapter("again", "Reproduce every number", _again(context)),
        Chapter("citation", "Citation", _citation(context)),
        Chapter("provenance", "Provenance",
                context.sections.make("The provenance", lambda: _provenance(context)) or ""),
    ]  # fmt: skip
    rest = [chapter for chapter in drafts if chapter.html]
    return [Chapter("short", "Summary", _short(context)), *rest]


def _short(context: ReportContext) -> str:
    said = paragraphs([finding(context.analysis)], "lead")
    if context.simulated:
        said += paragraphs(["These drops were simulated; nothing fell."], "note")
    notes = [*context.notes, *context.sections.failed.values()]
    return said + bullets(map(raised, notes))


def _figures(context: ReportContext, place: str) -> str:
    every = in_order(context.figures)
    made = [
        context.sections.make(f"Figure {number}", partial(embedded, picture, number))
        for number, picture in enumerate(every, 1)
        if picture.place == place
    ]
    return "".join(filter(None, made))


def _results(context: ReportContext) -> str:
    summary = context.sections.make("The table of results", lambda: _summary(context.analysis))
    return _figures(context, "results") + (summary or "")


def summary_html(lines: Sequence[Incline]) -> str:
    """Return the tables of the means of each measurand."""
    html = ""
    for row in averaged():
        those = [line for line in lines if row.name in line.means]
        if those:
            html += f"<h3>{escape(_titled(row))}</h3>"
            html += table(f"Means of {row.symbol}", summary_columns(row), those)
    return html


def _summary(analysis: Analysis) -> str:
    lines = analysis.summary
    if not lines:
        good = any(drop.verdict in GOOD for drop in analysis.runs)
        reason = "No mean can be given." if good else "No accepted runs, so no summary."
        return paragraphs([reason], "")
    html = summary_html(lines)
    note = "n is the number of runs that count, U the expanded uncertainty of their mean (95 %)."
    if any(line.normalized_error(name) is not None for line in lines for name in line.means):
        note += (
            " Eₙ is the difference from the prediction over the expanded uncertainty of that "
            "difference, the scatter of single falls included: within ±1 they agree."
        )
    return html + paragraphs([note])


def _titled(row: Measurand) -> str:
    return raised(f"{row.title} {row.symbol}")


def _budget(context: ReportContext) -> str:
    lines = [
        Mean(line, row)
        for row in averaged()
        for line in context.analysis.summary
        if row.name in line.means and line.means[row.name].budget
    ]
    if not lines:
        return _figures(context, "budget")
    columns: tuple[Column[Mean], ...] = (
        Column("", lambda mean: f"{mean.row.symbol} ({mean.row.fine})", numeric=False),
        *mean_columns(attrgetter("line")),
        Column("u, runs / √n", lambda mean: _part(mean, "runs")),
        Column("u, common", lambda mean: _part(mean, "common")),
        Column("u", lambda mean: fine(mean.row, mean.line.means[mean.row.name].u)),
        Column("U", lambda mean: fine(mean.row, mean.line.means[mean.row.name].expanded)),
        Column("largest common sources", lambda mean: _largest(*mean), numeric=False),
    )
    said = context.sections.make(
        "The uncertainty budget", lambda: table("Uncertainty of the means", columns, lines)
    )
    note = (
        "More runs reduce the first part, not the common one. The budget of every run is in "
        "budget.csv, in the data below."
    )
    return _figures(context, "budget") + (said or "") + paragraphs([note])


def _part(mean: Mean, name: str) -> str:
    return fine(mean.row, mean.line.means[mean.row.name].budget.get(name))


def _largest(line: Incline, row: Measurand) -> str:
    """Name the two largest sources of the common part."""
    return ", ".join(list(line.causes.get(row.name, ()))[:2])


def _impacts(context: ReportContext) -> str:
    return _figures(context, "impacts") + _parts(context, context.parts)


def _parts(context: ReportContext, parts: Sequence[Part]) -> str:
    made = [
        context.sections.make(f'The section "{part.heading}"', partial(_section, part))
        for part in parts
    ]
    return "".join(filter(None, made))


def _section(part: Part) -> str:
    shown = table(part.heading, part.columns, part.records) if part.records else ""
    if part.folded:
        shown = f"<details><summary>{escape(part.folded)}</summary>{shown}</details>"
    return f"<h3>{escape(part.heading)}</h3>{shown}{paragraphs(part.sentences)}"


def _drops(context: ReportContext) -> str:
    html = _figures(context, "drops") + _parts(context, context.effects)
    analysis = context.analysis
    every = sorted(
        (*analysis.runs, *analysis.superseded), key=lambda one: (one.run.number, one.attempt)
    )
    odd = [one for one in every if one.verdict != "accepted"]
    if odd:
        html += f"<h3>Reasons for verdicts</h3>{table('Verdicts', _VERDICTS, odd)}"
    if context.operator_notes:
        html += f"<h3>Notes</h3>{bullets(context.operator_notes)}"
    if context.deviations:
        html += f"<h3>Deviations from the plan</h3>{bullets(context.deviations)}"
    runs = context.sections.make("The table of runs", lambda: _runs(context))
    return html + (runs or "")


def _runs(context: ReportContext) -> str:
    analysis = context.analysis
    html = ""
    if analysis.runs:
        html += f"<h3>Every run</h3>{_run_table('Runs', analysis.runs, context.timelines)}"
        said = [f"Edges: {' / '.join(AUDIT)}."]
        if any(SEPARATION_RAW.name in one.quantities for one in analysis.runs):
            said.append(
                "Δz is corrected to simultaneous release; raw Δz is not. Skew is the release time "
                "of the free chain minus that of the impact chain."
            )
        html += paragraphs(said)
    if analysis.superseded:
        html += "<h3>Earlier attempts</h3>"
        html += _run_table("Earlier attempts", analysis.superseded, context.timelines)
    return html


def _run_table(name: str, runs: Sequence[DropResult], drawn: Sequence[Timeline]) -> str:
    off = {n for n, one in enumerate(runs) if one.verdict not in GOOD}
    there = {_anchor(one.result) for one in drawn}
    links = [anchor if (anchor := _anchor(one)) in there else "" for one in runs]
    return table(name, run_columns(), runs, off, links)


_VERDICTS: tuple[Column[DropResult], ...] = (
    Column("run", lambda one: str(one.run.number)),
    Column("attempt", lambda one: str(one.attempt)),
    Column("incline (°)", run_incline),
    Column("verdict", lambda one: one.verdict, numeric=False),
    Column("reasons", lambda one: signed(sentences(one.reasons)), numeric=False),
    Column(
        "what to do",
        lambda one: "; ".join(remedies(one.reasons)) if one.verdict == "void" else "",
        numeric=False,
    ),
)


def _anchor(result: DropResult) -> str:
    return f"drop-{result.run.number}-{result.attempt}"


def _timelines(context: ReportContext) -> str:
    if not context.timelines:
        return ""
    drops = "".join(_drop(one) for one in context.timelines)
    words = (
        "Each line is a gate; a bar shows when its beam was blocked. Marks across a line are "
        "unexplained edges."
    )
    drawn = len(context.timelines)
    every = len(context.analysis.runs) + len(context.analysis.superseded)
    left = [] if drawn == every else [f"{drawn} of {every} drops are drawn; rig tui shows all."]
    return f'{paragraphs([words, *left])}<div class="drops">{drops}</div>'


def _drop(one: Timeline) -> str:
    result = one.result
    run = result.run
    attempt = f", attempt {result.attempt}" if result.attempt > 1 else ""
    tilt = run_incline(result)
    head = " ".join(filter(None, [f"Run {run.number}{attempt}", f"{tilt}°" if tilt else ""]))
    verdict = (
        "" if result.verdict == "accepted" else f' <strong class="void">{result.verdict}</strong>'
    )
    audit = result.audit
    strikes = f"Chain {run.impact} strikes. " if run.impact else ""
    values = ", ".join(
        f"{row.symbol} {plus_minus(found, row.scale, row.decimals)} {row.unit}"
        for row in averaged()
        if (found := result.quantities.get(row.name)) is not None
    )
    words = (
        f"{strikes}{audit.matched} edges matched, {audit.missed} missed, {audit.spurious} "
        f"unexplained. {values}"
    )
    picture = scrolling(f"Gates of run {run.number}", one.svg)
    return (
        f"<details><summary>{escape(head)}{verdict}</summary>"
        f'<figure id="{_anchor(result)}">{picture}<figcaption>{escape(words)}</figcaption></figure>'
        "</details>"
    )


def _method(context: ReportContext) -> str:
    words = paragraphs(method_words(context.analysis), "")
    return words + _files(one for one in context.attachments if one.name == METHOD)


def _again(context: ReportContext) -> str:
    html = ""
    if context.again:
        commands = "\n".join(context.again)
        html = (
            "<p>The session file holds the raw edges, the bytes received and the protocol. These "
            f"commands compute every number again from it:</p><pre>{escape(commands)}</pre>"
        )
    return html + _files(one for one in context.attachments if one.name != METHOD)


def _files(attached: Iterable[Attachment]) -> str:
    items = "".join(f"<li>{link(one)}</li>" for one in attached)
    return f"<ul>{items}</ul>" if items else ""


def _citation(context: ReportContext) -> str:
    struck = any(one.run.impact is not None for one in context.analysis.runs)
    model = [f"Experiment and model: {PAPER}."] if struck else []
    return bullets([*model, f"Software: {SOFTWARE}."])


def _provenance(context: ReportContext) -> str:
    facts: list[tuple[str, object]] = list(context.provenance.items())
    if context.protocol_sha256:
        facts.append(("protocol SHA-256", context.protocol_sha256))
    facts += [("device", identity) for identity in context.identities]
    facts += [(f"clock: {name}", value) for name, value in context.clock.items()]
    html = "".join(
        f"<dt>{escape(str(name))}</dt><dd>{escape(_plain(value))}</dd>" for name, value in facts
    )
    html = f"<dl>{html}</dl>" if html else ""
    if context.protocol_text:
        name = escape(context.protocol_source or "the protocol")
        html += (
            f"<details open><summary>{name}</summary>"
            f"<pre>{escape(context.protocol_text)}</pre></details>"
        )
    return html


def _plain(value: object) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_plain(item)}" for key, item in value.items())
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False, default=str)
