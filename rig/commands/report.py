"""``rig report``."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from rig import __version__
from rig.analysis.curves import model_curves
from rig.analysis.result import GOOD
from rig.cache.entry import CacheEntry
from rig.commands.output import progress, say, stage, tell_damage
from rig.files import check_place, make_folder, write_atomic
from rig.films import film_digest, read_films
from rig.report.chapters import in_order
from rig.report.contents import timelines_and_data
from rig.report.deviations import deviations
from rig.report.estimate import page_parts
from rig.report.estimate_pictures import estimate_pictures
from rig.report.html import ReportContext, report_html
from rig.report.parts import effects_parts, gate_parts
from rig.report.pictures import pictures
from rig.report.remarks import remarks
from rig.results import protocol_of, results
from rig.results.estimated import session_estimate
from rig.results.whole import notes
from rig.sections import Sections
from rig.session.store import Session

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Sequence

    from rig.estimate.session import SessionEstimate
    from rig.report.bars import Bars
    from rig.report.parts import Part
    from rig.results import SessionResults


class ReportPage(NamedTuple):
    """A report as it is kept: its HTML and its figures, each as text, and what failed."""

    html: str
    figures: tuple[str, ...]
    failed: tuple[str, ...]


def main(arguments: Namespace) -> int:
    """Write a session's report."""
    check_place(arguments.output)
    with Session.open(arguments.session, readonly=True) as session:
        fresh = arguments.fresh
        outcome = results(session, progress("analysing run"), fresh=fresh, with_joint_fit=True)
        # The page has the file's name; how simulated chains moved lies beside the file.
        content = session.path.name, arguments.bars, film_digest(session.path)
        entry = CacheEntry(ReportPage, outcome.digest, content, fresh=fresh)
        page = entry.find()
        if page is None:
            page = make_page(session, outcome, arguments.bars, fresh=fresh)
            page = page if page.failed else entry.keep(page)
    write_atomic(arguments.output, page.html)
    if arguments.figures is not None:
        _write_figures(Path(arguments.figures), page.figures)
    for sentence in page.failed:
        say(sentence)
    say(f"report: {arguments.output}")
    return tell_damage(outcome.analysis)


def make_page(session: Session, outcome: SessionResults, bars: Bars, *, fresh: bool) -> ReportPage:
    """Draw the figures and write the page around them."""
    protocol = protocol_of(session)
    sections = Sections()
    stage("drawing figures")
    curves = sections.make("The model's curve", lambda: model_curves(protocol))
    figures = pictures(
        outcome.analysis,
        curves,
        session.simulated,
        skew_limit_s=protocol.accept.release_skew,
        site_m_s2=protocol.gravity.value,
        bars=bars,
        films=read_films(session.path) if session.simulated else None,
        sections=sections,
    )
    analysis = outcome.analysis
    compared = sections.make(
        "The paired differences", lambda: list(effects_parts(analysis.effects))
    )
    stage("estimating the impacts")
    gates = sections.make("The table of gates", lambda: list(gate_parts(analysis.summary)))
    estimated = sections.make(
        "The estimate of the impacts", lambda: _estimate(session, outcome, fresh=fresh)
    )
    parts: list[Part] = []
    if estimated is not None:
        stage("drawing the impacts")
        drawn = estimate_pictures(estimated, sections, simulated=session.simulated)
        figures += drawn.values()
        parts = list(page_parts(estimated, sections))
    stage("writing the page")
    timelines, data = timelines_and_data(session, protocol, outcome)
    figures = in_order(figures)
    name = session.path.name
    numerics = (f"{package} {version(package)}" for package in ("numpy", "scipy"))
    html = report_html(
        ReportContext(
            title=protocol.title,
            analysis=analysis,
            simulated=session.simulated,
            figures=figures,
            protocol_text=session.protocol_text,
            protocol_source=session.protocol_source,
            protocol_sha256=session.meta["protocol_sha256"],
            provenance={
                "session": name,
                "created": session.meta["created"],
                "origin": session.meta["origin"].partition("?")[0],
                "recorded with": f"rig {session.meta['rig_version']}",
                "analysed with": ", ".join([f"rig {__version__}", *numerics]),
            },
            identities=[identity for _, identity in session.identities()],
            clock=outcome.clock.details,
            notes=[*analysis.damage, *remarks(outcome)],
            operator_notes=_operator_notes(session),
            deviations=deviations(protocol, analysis, session.states()),
            parts=parts,
            effects=[*(gates or ()), *(compared or ())],
            timelines=timelines,
            again=[
                f"rig analyze {name} --json",
                f"rig report {name} -o report.html",
                f"rig replay {name}    # analyses the recorded bytes again",
            ],
            attachments=data,
            sections=sections,
        ),
    )
    stage("")
    failed = (*(estimated.failed if estimated else ()), *sections.failed.values())
    return ReportPage(html, tuple(picture.svg for picture in figures), failed)


def _operator_notes(session: Session) -> list[str]:
    """Tell what the protocol and operators noted, and which files they attached."""
    own, noted = protocol_of(session).notes, notes(session).items()
    runs = [f"Run {job.run}, attempt {job.attempt}: {text}" for job, text in noted]
    attached = [f"Attached {file.added}: {file.name}" for file in session.attached_files()]
    return [*([f"Protocol: {own}"] if own else []), *runs, *attached]


def _estimate(session: Session, outcome: SessionResults, *, fresh: bool) -> SessionEstimate | None:
    """What the impacts have in common; `None` where there are none, or none is good."""
    good = any(run.verdict in GOOD for run in outcome.analysis.runs)
    if protocol_of(session).surface is None or outcome.blind or not good:
        return None
    return session_estimate(session, outcome, fresh=fresh)


def _write_figures(folder: Path, figures: Sequence[str]) -> None:
    """Write ``figure-1.svg`` and on, numbered as in the report."""
    make_folder(folder)
    for number, svg in enumerate(figures, 1):
        write_atomic(folder / f"figure-{number}.svg", svg)
