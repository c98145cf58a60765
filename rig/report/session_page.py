"""The report of a session: which figures, claims and tables stand in which section.

It computes nothing: all numbers are those of the session's results.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from datetime import datetime
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from rig import __version__
from rig.analysis.curves import model_curves
from rig.analysis.result import GOOD
from rig.films import read_films
from rig.measurands import SEPARATION, acceleration_in
from rig.protocol.plan import runs as planned_runs
from rig.report import finding, parts, remarks
from rig.report.attachments import attachments
from rig.report.columns import Part, table_parts
from rig.report.deviations import deviations
from rig.report.estimate import page_parts
from rig.report.falls import fall_figures
from rig.report.figures import FEWEST_INCLINES, budget_figure, result_figure, runs_figure
from rig.report.film import film_figure
from rig.report.page import PageSection, ReportPage
from rig.report.templates import sentence
from rig.report.timeline import timelines
from rig.results import protocol_of
from rig.results.improvements import improvements
from rig.results.whole import notes
from rig.sections import Sections

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from rig.analysis.result import DropResult
    from rig.estimate.session import SessionEstimate
    from rig.protocol.protocol import Protocol
    from rig.records import Drop
    from rig.report.figure import Chart
    from rig.report.parts import Bars
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
_NUMERICS = ("numpy", "scipy")


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

    @property
    def drops(self) -> list[DropResult]:
        """All attempts at all runs, in order."""
        every = (*self.outcome.analysis.runs, *self.outcome.analysis.superseded)
        return sorted(every, key=lambda drop: (drop.run.number, drop.attempt))

    def made(self, words: str, make: Callable[[], Iterable[Any]]) -> list[Any]:
        """Return what a section consists of, less what there is not; nothing where that fails."""
        made = self.sections.make(words, lambda: [each for each in make() if each is not None])
        return made or []


def session_page(material: Material) -> ReportPage:
    """Return the report of a session."""
    session, outcome, made = material.session, material.outcome, material.made
    analysis, summary, protocol = outcome.analysis, outcome.analysis.summary, protocol_of(session)
    records = {(drop.run, drop.attempt): drop for drop in session.drops()}
    timed = [
        (record, outcome.clock.scale(record).hz, drop)
        for drop in material.drops
        if (record := records[drop.run.number, drop.attempt])
    ]
    falls = made("The figures of a fall", lambda: _falls(protocol, timed))
    curves = material.sections.make("The model's curve", lambda: model_curves(protocol)) or {}
    site = protocol.gravity.value if protocol.track is None else None
    results = made(
        "The figure of the result", lambda: [result_figure(analysis, curves, material.bars, site)]
    )
    many = len({line.incline_deg for line in summary}) >= FEWEST_INCLINES
    shown = [*results, *falls] if many or not falls else [falls[0], *results, *falls[1:]]
    judged = finding.verdict(summary)
    likeness = [] if analysis.rig is None or not analysis.rig.likeness else [analysis.rig.likeness]
    skew = protocol.accept.release_skew
    drops = made("The table of drops", lambda: _drops(protocol, timed))
    sections = [
        PageSection(
            "result",
            "Result",
            finding.claims(summary),
            shown[1:2],
            made(
                "The table of results",
                lambda: [
                    *(parts.value_parts(summary) if len(summary) > 1 else ()),
                    *parts.gate_parts(summary),
                ],
            ),
            made("The paired differences", lambda: parts.effects_parts(analysis.effects)),
        ),
        PageSection(
            "model",
            "Does it fit the model?",
            [judged.sentence, *(found.sentence for found in likeness)],
            [*shown[2:], *made("The pictures of the simulation", lambda: _films(material))],
            (),
            made("The comparison with the model", lambda: _model_parts(material)),
        ),
        PageSection(
            "limits",
            "What limits it",
            [*remarks.common_lines(summary), *(each.sentence for each in improvements(summary))],
            made("The figure of the budget", lambda: [budget_figure(summary)]),
            (),
            made("The uncertainty budget", lambda: parts.budget_parts(summary)),
        ),
        PageSection(
            "drops",
            "Every drop",
            deviations(protocol, analysis, session.states()),
            made("The figure of the runs", lambda: [runs_figure(analysis, skew)]),
            made("The reasons for verdicts", lambda: _odd_parts(material)),
            (),
            "drops.html" if drops else "",
            *drops,
        ),
        _method(material),
    ]
    hidden = ("model", "limits") if outcome.blind else ()
    return ReportPage(
        protocol.title,
        [section for section in sections if section.content and section.anchor not in hidden],
        session.simulated,
        shown[:1],
        finding.headline(summary),
        judged.sentence
        if summary and not outcome.blind
        else sentence(
            "no_mean", outcome.blind, any(drop.verdict in GOOD for drop in analysis.runs)
        ),
        not judged.agrees or not summary,
        _what_was_done(material, protocol),
        [*analysis.damage, *(f"{words}." for words in material.sections.failed.values())],
        sentence("source", session, __version__),
    )


def _what_was_done(material: Material, protocol: Protocol) -> str:
    """Count drops and inclines, and say when, and where the plan was left."""
    inclines = {drop.run.incline_deg for drop in material.drops if drop.run.impact is not None}
    created = datetime.fromisoformat(material.session.meta["created"])
    planned = len(planned_runs(protocol))
    return sentence("done", material.outcome.analysis, len(inclines), created, planned)


def _falls(protocol: Protocol, timed: Iterable[tuple[Drop, Any, DropResult]]) -> Iterator[Chart]:
    """Draw the good run that shows most: where the separation is largest, else the first."""

    def separation(drop: DropResult) -> float:
        value = drop.quantities.get(SEPARATION.name)
        return value.value if value else 0.0

    good = [each for each in timed if each[-1].verdict in GOOD]
    if good:
        yield from fall_figures(protocol, *max(good, key=lambda each: separation(each[-1])))


def _films(material: Material) -> Iterator[Chart]:
    """Draw how simulated chains fell: the first that counts, and the first that does not."""
    films = read_films(material.session.path) if material.session.simulated else {}
    kinds = {
        drop.verdict in GOOD: films[drop.run.number, drop.attempt]
        for drop in reversed(material.outcome.analysis.runs)
        if (drop.run.number, drop.attempt) in films
    }
    return (film_figure(kinds[good]) for good in (True, False) if good in kinds)


def _model_parts(material: Material) -> Iterator[Part]:
    yield from parts.means_parts(material.outcome.analysis.summary)
    if material.estimated is not None:
        yield from page_parts(material.estimated, material.sections)


def _odd_parts(material: Material) -> Iterator[Part]:
    yield from parts.verdict_parts(material.drops)
    session, own = material.session, protocol_of(material.session).notes
    lines = [
        *([f"Protocol: {own}"] if own else []),
        *(f"Run {job.run}, attempt {job.attempt}: {text}" for job, text in notes(session).items()),
        *(f"Attached {file.added}: {file.name}" for file in session.attached_files()),
    ]
    yield from (replace(part, bullets=True) for part in table_parts("notes", (), lines))


def _drops(
    protocol: Protocol, timed: list[tuple[Drop, Any, DropResult]]
) -> Iterator[dict[str, Any]]:
    """Yield what `drops.html` asks for: the table of all drops, and their timelines."""
    results = [drop for *_, drop in timed]
    lanes, shown = timelines(protocol.gates.gates if protocol.gates else (), timed)
    off = {number for number, drop in enumerate(results) if drop.verdict not in GOOD}
    links = {number: drawn.anchor for number, drawn in shown.items()}
    for part in parts.run_parts(results):
        table = replace(part, off=off, links=links)
        yield {"table": table, "results": results, "lanes": lanes, "timelines": shown}


def _method(material: Material) -> PageSection:
    session, outcome = material.session, material.outcome
    analysis, rig = outcome.analysis, outcome.analysis.rig
    free = acceleration_in({name for drop in analysis.runs for name in drop.quantities})
    said = [
        *remarks.alone_lines(analysis),
        *remarks.clock_lines(outcome.calibration),
        *remarks.air_lines(None if rig is None else rig.drag),
    ]
    values = {
        "session": session,
        "outcome": outcome,
        "runs": analysis.runs,
        "said": said,
        "pull": free.symbol if free else "g",
        "together": None if outcome.blind else rig is not None,
        "files": material.made("The files", lambda: attachments(session, outcome)),
        "paper": PAPER,
        "software": SOFTWARE,
        "versions": {"rig": __version__} | {name: version(name) for name in _NUMERICS},
    }
    return PageSection("method", "Method and files", template="method.html", values=values)
