"""``rig report``."""

from functools import partial
from typing import NamedTuple

from rig.analysis.result import GOOD
from rig.cache.entry import recall
from rig.commands.output import Arguments, progress, say, stage, tell_damage
from rig.estimate.session import SessionEstimate
from rig.files import write_atomic
from rig.report.canvas import write_figures
from rig.report.figure import Chart
from rig.report.parts import Bars
from rig.report.session_page import session_page
from rig.report.templates import page_html
from rig.results.estimated import session_estimate
from rig.results.whole import SessionResults, protocol_of, results
from rig.sections import Sections
from rig.session.store import Session


class Report(NamedTuple):
    """A report as it is kept: its HTML, its figures, and what failed."""

    html: str
    figures: tuple[Chart, ...]
    failed: tuple[str, ...]


def main(arguments: Arguments) -> int:
    """Write a session's report."""
    if arguments.pdf is not None:
        from rig.report.pdf import write_pdf  # noqa: PLC0415 - an extra that few need

    with Session.open(arguments.session, readonly=True) as session:
        fresh, estimate = arguments.fresh, arguments.estimate
        outcome = results(session, progress, fresh=fresh)
        make = partial(
            make_report, session, outcome, arguments.bars, estimate=estimate, fresh=fresh
        )
        # The page has the file's name.
        content = outcome.digest, session.path.name, arguments.bars, estimate
        report = recall(Report, make, *content, fresh=fresh)
    write_atomic(arguments.output, report.html)
    if arguments.figures is not None:
        stage("drawing figures")
        write_figures(arguments.figures, report.figures)
        stage("")
    if arguments.pdf is not None:
        write_pdf(arguments.pdf, report.html, report.figures)
        say(f"PDF: {arguments.pdf}")
    say("\n".join((*report.failed, f"report: {arguments.output}")))
    return tell_damage(outcome.analysis)


def make_report(
    session: Session, outcome: SessionResults, bars: Bars, *, estimate: bool, fresh: bool
) -> Report:
    """Write the page from what was found."""
    sections, estimated = Sections(), None
    if estimate:
        stage("estimating the impacts")
        with sections.alone("The estimate of the impacts"):
            estimated = _estimate(session, outcome, fresh=fresh)
    stage("writing the page")
    html, figures = page_html(session_page(session, outcome, bars, estimated, sections))
    stage("")
    failed = (*(estimated.failed if estimated else ()), *sections.failed.values())
    return Report(html, tuple(figures), failed)


def _estimate(session: Session, outcome: SessionResults, *, fresh: bool) -> SessionEstimate | None:
    """What the impacts have in common; `None` where there are none, or none is good."""
    good = any(run.verdict in GOOD for run in outcome.analysis.runs)
    if protocol_of(session).surface is None or outcome.blind or not good:
        return None
    return session_estimate(session, outcome, fresh=fresh)
