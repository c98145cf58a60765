"""The report: one HTML page that needs nothing but itself."""

from __future__ import annotations

from dataclasses import dataclass, field
from html import escape
from importlib.resources import files
from typing import TYPE_CHECKING

from rig.report.chapters import chapters
from rig.report.embed import dark_figure_css
from rig.sections import Sections

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rig.analysis.session import Analysis
    from rig.report.attachments import Attachment
    from rig.report.chapters import Chapter
    from rig.report.embed import PageFigure
    from rig.report.parts import Part
    from rig.report.timeline import Timeline


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
    operator_notes, deviations
        What was noted to drops; where the session departed from the plan.
    parts, effects
        Tables on the impacts, and on chains and sides.
    timelines
        Of drops, in order.
    again
        Commands that make the numbers anew.
    attachments
        Files that the page carries.
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
    operator_notes: Sequence[str] = ()
    deviations: Sequence[str] = ()
    parts: Sequence[Part] = ()
    effects: Sequence[Part] = ()
    timelines: Sequence[Timeline] = ()
    again: Sequence[str] = ()
    attachments: Sequence[Attachment] = ()
    sections: Sections = field(default_factory=Sections)


def report_html(context: ReportContext) -> str:
    """Return the page.

    Parameters
    ----------
    context
        What to say. All text is escaped; figures are trusted.
    """
    return page_html(context.title, chapters(context), simulated=context.simulated)


def page_html(heading: str, made: Sequence[Chapter], *, simulated: bool) -> str:
    """Return a page of chapters.

    Parameters
    ----------
    heading
        Of the page, which is escaped; chapters are trusted.
    simulated
        Whether to stamp the page.
    """
    title = escape(heading)
    stamp = '<p class="stamp">SIMULATED DATA</p>' if simulated else ""
    mark = "SIMULATED – " if simulated else ""
    links = "".join(f'<li><a href="#{one.anchor}">{one.heading}</a></li>' for one in made)
    body = "\n".join(
        f'<section id="{one.anchor}" aria-labelledby="{one.anchor}-h">'
        f'<h2 id="{one.anchor}-h">{one.heading}</h2>{one.html}</section>'
        for one in made
    )
    css = files("rig.report").joinpath("page.css").read_text(encoding="utf-8") + dark_figure_css()
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        # Should anything slip through the escaping, nothing runs and nothing is fetched.
        '<meta http-equiv="Content-Security-Policy" '
        "content=\"default-src 'none'; style-src 'unsafe-inline'\">\n"
        f"<title>{mark}{title}</title>\n<style>\n{css}</style>\n</head>\n"
        f'<body>\n<a class="skip" href="#short">Skip to content</a>\n'
        f"<header><h1>{title}</h1>{stamp}</header>\n"
        f'<nav aria-label="Contents"><ul>{links}</ul></nav>\n'
        f"<main>\n{body}\n</main>\n</body>\n</html>\n"
    )
