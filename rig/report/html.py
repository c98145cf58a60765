"""The report: one HTML page that needs nothing but itself."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from html import escape
from importlib.resources import files
from typing import TYPE_CHECKING, Any, TypeVar, get_args

from rig.analysis.remedies import remedies
from rig.analysis.result import GOOD, Verdict
from rig.files import write_atomic
from rig.measurands import SEPARATION_RAW
from rig.report.columns import AUDIT, Column, filled, main_error, run_columns, summary_columns
from rig.report.embed import dark_figure_css, embedded
from rig.sections import Sections

if TYPE_CHECKING:
    import os
    from collections.abc import Container, Sequence

    from rig.analysis.result import DropResult
    from rig.analysis.session import Analysis
    from rig.analysis.summary import Incline
    from rig.report.embed import PageFigure
    from rig.report.parts import Part

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class ReportContext:
    """Everything a report says; what a scene does not have stays empty and is left out.

    Attributes
    ----------
    title
        Of the protocol.
    simulated
        Whether to stamp the page.
    figures
        See `rig.report.pictures.pictures`.
    protocol_text, protocol_source, protocol_sha256
        The protocol file word for word, its name and digest.
    provenance
        Further facts in order, such as session file, creation time, versions, origin.
    identities
        What each device said it is.
    clock
        The clock calibration, in words or numbers by name.
    notes
        Sentences for the reader: warnings, what was left out.
    parts
        Further sections, after the runs.
    sections
        What could not be made so far is said on the page; what fails there joins it.
    """

    title: str
    analysis: Analysis
    simulated: bool
    figures: Sequence[PageFigure] = ()
    protocol_text: str = ""
    protocol_source: str = ""
    protocol_sha256: str = ""
    provenance: Mapping[str, object] = field(default_factory=dict)
    identities: Sequence[Mapping[str, object]] = ()
    clock: Mapping[str, object] = field(default_factory=dict)
    notes: Sequence[str] = ()
    parts: Sequence[Part] = ()
    sections: Sections = field(default_factory=Sections)


def write_report(path: str | os.PathLike[str], context: ReportContext) -> None:
    """Write `report_html` to a file, whole or not at all.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    write_atomic(path, report_html(context))


def report_html(context: ReportContext) -> str:
    """Return the page.

    Parameters
    ----------
    context
        What to say. All text is escaped; figures are trusted.
    """
    title = escape(context.title)
    stamp = '<p class="stamp">SIMULATED DATA</p>' if context.simulated else ""
    mark = "SIMULATED – " if context.simulated else ""
    make = context.sections.make
    parts = [
        make("The table of results", lambda: _summary(context.analysis.summary)),
        *(
            make(f"Figure {number}", partial(embedded, picture, number))
            for number, picture in enumerate(context.figures, 1)
        ),
        make("The table of runs", lambda: _runs(context.analysis)),
        *(make(f'The section "{part.heading}"', partial(_part, part)) for part in context.parts),
        make("The uncertainty budget", lambda: _budget(context.analysis.runs)),
        make("The provenance", lambda: _provenance(context)),
    ]
    header = f"<header><h1>{title}</h1>{_subtitle(context)}{stamp}</header>"
    parts = [header, _notes(context), *parts]  # notes last made: by then all failures are known
    css = files("rig.report").joinpath("page.css").read_text(encoding="utf-8") + dark_figure_css()
    body = "\n".join(filter(None, parts))
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        # Should anything slip through the escaping, nothing runs and nothing is fetched.
        '<meta http-equiv="Content-Security-Policy" '
        "content=\"default-src 'none'; style-src 'unsafe-inline'\">\n"
        f"<title>{mark}{title}</title>\n<style>\n{css}</style>\n</head>\n"
        f"<body>\n{body}\n</body>\n</html>\n"
    )


def _subtitle(context: ReportContext) -> str:
    runs = context.analysis.runs
    verdicts = [one.verdict for one in runs]
    counts = [
        f"{verdicts.count(verdict)} {verdict}"
        for verdict in get_args(Verdict)
        if verdict in verdicts
    ]
    noun = "run" if len(runs) == 1 else "runs"
    words = f"{len(runs)} {noun}" + (f": {', '.join(counts)}" if counts else "")
    return f'<p class="sub">{escape(words)}</p>'


def _notes(context: ReportContext) -> str:
    notes = (*context.notes, *context.sections.failed.values())
    return "".join(f'<p class="note">{escape(note)}</p>' for note in notes)


def _summary(lines: Sequence[Incline]) -> str:
    if not lines:
        return "<h2>Summary</h2><p>No accepted runs, so no summary.</p>"
    note = "U is the expanded uncertainty of the mean (95 %)."
    if any(main_error(line) is not None for line in lines):
        note += (
            " Eₙ is the difference from the prediction over its expanded uncertainty: within ±1 "
            "they agree."
        )
    return f'<h2>Summary</h2>{_table(summary_columns(), lines)}<p class="note">{note}</p>'


def _runs(analysis: Analysis) -> str:
    html = ""
    if analysis.runs:
        html += f"<h2>Runs</h2>{_run_table(analysis.runs)}"
        if any(SEPARATION_RAW.name in one.quantities for one in analysis.runs):
            html += (
                '<p class="note">Δz is corrected to simultaneous release, raw Δz is as it '
                "happened. Skew is the free chain's release less the impact chain's.</p>"
            )
        html += f'<p class="note">Edges: {" / ".join(AUDIT)}.</p>'
    if analysis.superseded:
        html += f"<h2>Earlier attempts</h2>{_run_table(analysis.superseded)}"
    return html


def _part(part: Part) -> str:
    table = _table(part.columns, part.records) if part.records else ""
    notes = "".join(f'<p class="note">{escape(sentence)}</p>' for sentence in part.sentences)
    if part.folded:
        table = f"<details><summary>{escape(part.folded)}</summary>{table}</details>"
    return f"<h2>{escape(part.heading)}</h2>{table}{notes}"


def _budget(runs: Sequence[DropResult]) -> str:
    lines = [
        {"run": one.run.number, "source": source, "quantity": name, "u": u}
        for one in runs
        for name, value in one.quantities.items()
        for source, u in value.budget.items()
    ]
    if not lines:
        return ""
    columns: tuple[Column[Mapping[str, Any]], ...] = (
        Column("run", lambda line: str(line["run"])),
        Column("source", lambda line: str(line["source"]), numeric=False),
        Column("quantity", lambda line: str(line["quantity"]), numeric=False),
        Column("standard uncertainty (SI)", lambda line: f"{line['u']:.2g}"),
    )
    return (
        "<h2>Uncertainty budget</h2><details><summary>Standard uncertainty of each run by source"
        f"</summary>{_table(columns, lines)}</details>"
    )


def _run_table(runs: Sequence[DropResult]) -> str:
    off = {n for n, one in enumerate(runs) if one.verdict not in GOOD}
    return _table(run_columns(), runs, off, [_why(one) for one in runs])


def _table(
    columns: Sequence[Column[T]],
    records: Sequence[T],
    off: Container[int] = (),
    reasons: Sequence[str] = (),
) -> str:
    """Make a table; the rows numbered in `off` are grey, and below a row stands its reason."""
    kept, rows = filled(columns, records)
    sides = [' class="num"' if column.numeric else "" for column in kept]
    head = "".join(
        f'<th scope="col"{side}>{escape(column.heading)}</th>'
        for column, side in zip(kept, sides, strict=True)
    )
    body = ""
    for n, row in enumerate(rows):
        cells = "".join(
            _cell(column, text, side) for column, text, side in zip(kept, row, sides, strict=True)
        )
        struck_off = ' class="off"' if n in off else ""
        body += f"<tr{struck_off}>{cells}</tr>\n"
        if n < len(reasons) and (why := reasons[n]):
            # A line of their own: sentences do not fit beside so many numbers.
            body += f'<tr class="why"><td colspan="{len(kept)}">{escape(why)}</td></tr>\n'
    return (
        f'<div class="scroll"><table><thead><tr>{head}</tr></thead>\n'
        f"<tbody>\n{body}</tbody></table></div>"
    )


def _why(one: DropResult) -> str:
    """Reasons of a verdict, and of a void drop what to do."""
    what = remedies(one.reasons) if one.verdict == "void" else []
    return " → ".join(filter(None, ["; ".join(one.reasons), "; ".join(what)]))


def _cell(column: Column[Any], text: str, side: str) -> str:
    if column.heading == "verdict":
        side = f' class="{escape(text)}"'
    return f"<td{side}>{escape(text)}</td>"


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
    return f"<h2>Provenance</h2>{html}" if html else ""


def _plain(value: object) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_plain(item)}" for key, item in value.items())
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False, default=str)
