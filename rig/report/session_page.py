"""The report of a session: which figures, claims and tables stand in which section.

It computes nothing: all numbers are those of the session's results.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from rig import __version__
from rig.analysis.curves import model_curves
from rig.analysis.result import GOOD
from rig.films import read_films
from rig.measurands import SEPARATION, SEPARATION_RAW, acceleration_in, averaged
from rig.protocol.plan import runs as planned_runs
from rig.reasons import remedies, sentences
from rig.report.attachments import attachments
from rig.report.columns import Column, run_columns, run_incline, value_columns
from rig.report.deviations import deviations
from rig.report.estimate import page_parts
from rig.report.falls import fall_figures
from rig.report.figures import FEWEST_INCLINES, budget_figure, result_figures, runs_figure
from rig.report.film import film_figure
from rig.report.finding import count, headline, raised, verdict
from rig.report.numbers import plus_minus, signed
from rig.report.page import PageSection, ReportPage, filled_table
from rig.report.parts import Part, budget_part, effects_parts, gate_parts, means_parts
from rig.report.remarks import air_lines, alone_lines, clock_lines, common_lines
from rig.report.timeline import lanes, timeline
from rig.results import protocol_of
from rig.results.improvements import improvements
from rig.results.whole import notes
from rig.sections import Sections

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rig.analysis.result import DropResult
    from rig.analysis.session import Analysis
    from rig.estimate.session import SessionEstimate
    from rig.protocol.protocol import Protocol
    from rig.records import Drop
    from rig.report.bars import Bars
    from rig.report.figure import Chart
    from rig.results import SessionResults
    from rig.session.reading import Reader

PAPER = (
    "J. Pantaleone, Understanding and enhancing the impact-induced tension of a falling chain, "
    "arXiv:2207.02692 (2022)"
)
SOFTWARE = (
    f"the chainrig authors, chainrig {__version__}: lab-rig controller for falling-chain and "
    "photogate experiments (2026), MIT licence"
)
_BLIND = "The results of this session are hidden until `rig unblind`."
_NUMERICS = ("numpy", "scipy")
_TIMELINES = 480_000
"""Characters of all timelines together, see `rig.report.attachments`."""
_AROUND = 900  # characters of a timeline's frame and caption
_VERDICTS: tuple[Column[DropResult], ...] = (
    Column("run", lambda drop: str(drop.run.number)),
    Column("attempt", lambda drop: str(drop.attempt)),
    Column("incline (°)", run_incline),
    Column("verdict", lambda drop: drop.verdict, numeric=False),
    Column("reasons", lambda drop: signed(sentences(drop.reasons)), numeric=False),
    Column(
        "what to do",
        lambda drop: "; ".join(remedies(drop.reasons)) if drop.verdict == "void" else "",
        numeric=False,
    ),
)


@dataclass(frozen=True, slots=True)
class Material:
    """What a report is made from.

    Attributes
    ----------
    outcome
        The session's results.
    bars
        What the bars on means stand for.
    estimated
        What `rig estimate` says of the impacts, where that is wanted.
    sections
        Where a section that cannot be made is noted.
    """

    session: Reader
    outcome: SessionResults
    bars: Bars = "U95"
    estimated: SessionEstimate | None = None
    sections: Sections = field(default_factory=Sections)


def session_page(material: Material) -> ReportPage:
    """Return the report of a session."""
    session, outcome, make = material.session, material.outcome, material.sections.make
    analysis, protocol = outcome.analysis, protocol_of(material.session)
    simulated = session.simulated
    drops = {(drop.run, drop.attempt): drop for drop in session.drops()}
    falls = make("The figures of a fall", lambda: _falls(material, protocol, drops)) or []
    curves = make("The model's curve", lambda: model_curves(protocol)) or {}
    results = make("The figure of the result", lambda: [*result_figures(
        analysis, curves, simulated=simulated, bars=material.bars,
        site_m_s2=protocol.gravity.value if protocol.track is None else None,
    )]) or []  # fmt: skip
    many = len({line.incline_deg for line in analysis.summary}) >= FEWEST_INCLINES
    shown = [*results, *falls] if many or not falls else [falls[0], *results, *falls[1:]]
    limits = make("The figure of the budget", lambda: budget_figure(
        analysis.summary, simulated=simulated))  # fmt: skip
    in_order = make("The figure of the runs", lambda: runs_figure(
        analysis, simulated=simulated, skew_limit_s=protocol.accept.release_skew))  # fmt: skip
    judged = verdict(analysis.summary)
    likeness = None if analysis.rig is None else analysis.rig.likeness
    sections = [
        PageSection(
            "result",
            "Result",
            [*_claims(material)],
            shown[1:2],
            make("The table of results", lambda: _result_parts(material)) or (),
            make("The paired differences", lambda: [*effects_parts(analysis.effects)]) or (),
        ),
        PageSection(
            "model",
            "Does it fit the model?",
            [judged.sentence, *([likeness.sentence] if likeness else [])],
            [*shown[2:], *(make("The pictures of the simulation", lambda: _films(material)) or ())],
            (),
            make("The comparison with the model", lambda: _model_parts(material)) or (),
        ),
        PageSection(
            "limits",
            "What limits it",
            [*common_lines(analysis.summary),
             *(better.sentence for better in improvements(analysis.summary))],
            [limits] if limits else [],
            (),
            make("The uncertainty budget", lambda: [*budget_part(analysis.summary)]) or (),
        ),
        PageSection(
            "drops",
            "Every drop",
            deviations(protocol, analysis, session.states()),
            [in_order] if in_order else [],
            [*_drop_parts(material)],
            (),
            make("The table of drops", lambda: _drops(material, protocol, drops)) or {},
        ),
        _method(material),
    ]  # fmt: skip
    blind = outcome.blind
    return ReportPage(
        protocol.title,
        [section for section in sections if _has_content(section, blind=blind)],
        simulated,
        shown[0] if shown else None,
        headline(analysis.summary),
        _BLIND if blind else judged.sentence if analysis.summary else _no_mean(analysis),
        not judged.agrees or not analysis.summary,
        _what_was_done(material, protocol),
        [*analysis.damage, *(f"{sentence}." for sentence in material.sections.failed.values())],
        _source(session),
    )


def _has_content(section: PageSection, *, blind: bool) -> bool:
    """Tell whether a section says anything: without means there is nothing to compare."""
    if section.anchor in {"model", "limits"}:
        return not blind and bool(section.figures or section.referee or section.parts)
    return bool(section.figures or section.parts or section.drops or section.method)


def _no_mean(analysis: Analysis) -> str:
    good = any(drop.verdict in GOOD for drop in analysis.runs)
    return "No mean can be given." if good else "No accepted runs, so no mean."


def _what_was_done(material: Material, protocol: Protocol) -> str:
    """Count drops and inclines, and say when, and where the plan was left."""
    analysis = material.outcome.analysis
    drops = (*analysis.runs, *analysis.superseded)
    inclines = {drop.run.incline_deg for drop in drops if drop.run.impact is not None}
    words = [count(len(drops), "drop")]
    words += [count(len(inclines), "incline")] if len(inclines) > 1 else []
    words += [
        f"{number} {name}"
        for name in ("marginal", "void", "rejected")
        if (number := sum(drop.verdict == name for drop in drops))
    ]
    created = datetime.fromisoformat(material.session.meta["created"])
    words.append(f"{created.day} {created:%B %Y}")
    planned = len(planned_runs(protocol))
    stopped = len(analysis.runs) < planned
    end = f"; stopped after {len(analysis.runs)} of {planned} runs" if stopped else ""
    return f"{', '.join(words)}{end}."


def _source(session: Reader) -> str:
    """Name the session, what recorded it and its protocol in one line."""
    recorded, digest = (session.meta[name] for name in ("rig_version", "protocol_sha256"))
    return (
        f"{session.path.name} · {_origin(session)} · recorded with rig {recorded}, analysed with "
        f"rig {__version__} · protocol {digest[:8]}"
    )


def _origin(session: Reader) -> str:
    return session.meta["origin"].partition("?")[0]


def _falls(
    material: Material, protocol: Protocol, drops: Mapping[tuple[int, int], Drop]
) -> list[Chart]:
    """Draw the good drop that shows most: where the separation is largest, else the first."""
    good = [drop for drop in material.outcome.analysis.runs if drop.verdict in GOOD]
    if not good:
        return []
    size = {drop.run.number: drop.quantities.get(SEPARATION.name) for drop in good}
    shown = max(good, key=lambda drop: value.value if (value := size[drop.run.number]) else 0.0)
    record = drops[shown.run.number, shown.attempt]
    hz = material.outcome.clock.scale(record).hz
    simulated = material.session.simulated
    return [*fall_figures(protocol, record, hz, shown, simulated=simulated)]


def _films(material: Material) -> list[Chart]:
    """Draw how simulated chains fell: the first that counts, and the first that does not."""
    if not material.session.simulated:
        return []
    films = read_films(material.session.path)
    runs = [drop for drop in material.outcome.analysis.runs
            if (drop.run.number, drop.attempt) in films]  # fmt: skip
    shown = [
        next((drop for drop in runs if (drop.verdict in GOOD) is good), None)
        for good in (True, False)
    ]
    return [film_figure(films[drop.run.number, drop.attempt]) for drop in shown if drop]


def _claims(material: Material) -> Iterator[str]:
    """Say in a sentence what was found."""
    summary = material.outcome.analysis.summary
    names = {name for line in summary for name in line.means}
    if not summary:
        return
    numbers = [f"{number.value} {number.unit}" for number in headline(summary)]
    where = [number.words.partition(" at ")[2] for number in headline(summary)]
    if SEPARATION.name in names:
        least = f", and by {numbers[1]} at {where[1]}" if len(summary) > 1 else ""
        place = f" at {where[0]}" if where[0] else ""
        yield (
            f"When its top rod arrives, the striking chain is ahead by {numbers[0]}{place}{least}."
        )
    elif (row := acceleration_in(names)) is not None:
        yield f"All {summary[0].n} counted runs together give {row.symbol} = {numbers[0]}."
    else:
        yield f"The top rod arrives with V = {numbers[0]}{f' at {where[0]}' if where[0] else ''}."


def _result_parts(material: Material) -> list[Part]:
    summary = material.outcome.analysis.summary
    rows = [row for row in averaged() if any(row.name in line.means for line in summary)]
    means = [Part("", ["n: runs that count. U: expanded uncertainty of the mean (95 %)."],
                  value_columns(rows), summary)] if len(summary) > 1 else []  # fmt: skip
    return [*means, *gate_parts(summary)]


def _model_parts(material: Material) -> list[Part]:
    parts = means_parts(material.outcome.analysis.summary)
    if material.estimated is not None:
        parts += page_parts(material.estimated, material.sections)
    return parts


def _drop_parts(material: Material) -> Iterator[Part]:
    odd = [drop for drop in _every_drop(material) if drop.verdict != "accepted"]
    if odd:
        yield Part("Reasons for verdicts", (), _VERDICTS, odd)
    said = notes(material.session)
    if said:
        lines = [f"Run {job.run}, attempt {job.attempt}: {text}" for job, text in said.items()]
        yield Part("Operator's notes", lines, bullets=True)


def _every_drop(material: Material) -> list[DropResult]:
    analysis = material.outcome.analysis
    every = (*analysis.runs, *analysis.superseded)
    return sorted(every, key=lambda drop: (drop.run.number, drop.attempt))


def _drops(
    material: Material, protocol: Protocol, drops: Mapping[tuple[int, int], Drop]
) -> dict[str, Any]:
    """Return the table of all drops, and the timelines to which its rows lead."""
    every = _every_drop(material)
    if not every:
        return {}
    scale = material.outcome.clock.scale
    timed = [
        (record, scale(record).hz)
        for result in every
        for record in [drops[result.run.number, result.attempt]]
    ]
    shared = lanes(protocol.gates.gates if protocol.gates else (), timed)
    shown, left = {}, _TIMELINES
    # Those that do not count come first where not all have room.
    for number in sorted(range(len(every)), key=lambda n: (every[n].verdict == "accepted", n)):
        result = every[number]
        bars, odd = timeline(shared, *timed[number], result)
        left -= len(bars) + len(odd) + _AROUND
        if bars and left > 0:
            values = "".join(
                f", {row.symbol} {plus_minus(value, row.scale, row.decimals)} {row.unit}"
                for row in averaged()
                if (value := result.quantities.get(row.name)) is not None
            )
            anchor = f"drop-{result.run.number}-{result.attempt}"
            shown[number] = {
                "anchor": anchor, "result": result, "bars": bars, "odd": odd, "numbers": values
            }  # fmt: skip
    off = {n for n, drop in enumerate(every) if drop.verdict not in GOOD}
    links = {number: str(line["anchor"]) for number, line in shown.items()}
    return {
        "table": filled_table("Drops", run_columns(), every, off, links),
        "timelines": [shown[number] for number in sorted(shown)],
        "lanes": shared,
        "raw": any(SEPARATION_RAW.name in drop.quantities for drop in every),
        "hidden": len(every) - len(shown) if shown else 0,
    }


def _method(material: Material) -> PageSection:
    session, outcome = material.session, material.outcome
    analysis, name = outcome.analysis, material.session.path.name
    measured = acceleration_in({name for drop in analysis.runs for name in drop.quantities})
    struck = any(drop.run.impact is not None for drop in analysis.runs)
    rig = analysis.rig
    remarks = [
        *alone_lines(analysis),
        *clock_lines(outcome.calibration),
        *air_lines(None if rig is None else rig.drag),
    ]
    meta = session.meta
    packages = ", ".join(f"{name} {version(name)}" for name in _NUMERICS)
    rows: list[tuple[str, object]] = [
        ("session", name), ("created", meta["created"]), ("origin", _origin(session)),
        ("recorded with", f"rig {meta['rig_version']}"),
        ("analysed with", f"rig {__version__}, {packages}"),
        ("protocol SHA-256", meta["protocol_sha256"]),
        *(("device", identity) for _, identity in session.identities()),
        *((f"clock: {what}", value) for what, value in outcome.clock.details.items()),
    ]  # fmt: skip
    method = {
        "struck": struck,
        "apart": any(SEPARATION.name in drop.quantities for drop in analysis.runs),
        "pull": measured.symbol if measured else "g",
        "together": None if outcome.blind else rig is not None,
        "again": [
            f"rig analyze {name} --json",
            f"rig report {name} -o report.html",
            f"rig replay {name}    # analyses the recorded bytes again",
        ],
        "files": material.sections.make("The files", lambda: attachments(session, outcome)) or [],
        "paper": PAPER,
        "software": SOFTWARE,
    }
    return PageSection(
        "method",
        "Method and files",
        method=method,
        referee=[Part("", [*map(raised, remarks)], bullets=True)] if remarks else [],
        facts=[(what, _plain(value)) for what, value in rows],
        protocol=(session.protocol_source or "the protocol", session.protocol_text),
    )


def _plain(value: object) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_plain(item)}" for key, item in value.items())
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False, default=str)
