"""A page as plain data: its card, its sections as rows, and the one template that writes them."""

from __future__ import annotations

import base64
from dataclasses import dataclass, field, replace
from functools import partial
from hashlib import sha256
from itertools import count
from typing import TYPE_CHECKING, Any

from rig.report import looks
from rig.report.figure import COLUMN_PT, WIDE_PT
from rig.report.templates import environment, render

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rig.report.columns import Part
    from rig.report.figure import Chart
    from rig.report.finding import Number

_WIDTHS = {"slim": COLUMN_PT, "wide": WIDE_PT}
"""A figure is drawn for a telephone and for a page; whichever has room is shown."""


@dataclass(frozen=True, slots=True)
class PageSection:
    """One section: what it claims, then its figures, and what only a referee wants below.

    Attributes
    ----------
    parts, referee
        Tables and sentences, shown and folded.
    template, values
        Of what else stands there, and what it asks for.
    """

    anchor: str
    heading: str
    claims: Sequence[str] = ()
    figures: Sequence[Chart] = ()
    parts: Sequence[Part] = ()
    referee: Sequence[Part] = ()
    template: str = ""
    values: Mapping[str, Any] = field(default_factory=dict)

    @property
    def content(self) -> bool:
        """Whether there is more than claims."""
        return bool(self.figures or self.parts or self.referee or self.template)


@dataclass(frozen=True, slots=True)
class ReportPage:
    """A whole page; what a scene does not have stays empty and is left out.

    Attributes
    ----------
    first
        The figure of the first screen.
    numbers, verdict, doubt, counted, warnings, source
        Of the card: numbers, a sentence and whether it is bad news, what was done, what the reader
        must know, where it comes from.
    """

    title: str
    sections: Sequence[PageSection]
    simulated: bool = False
    first: Sequence[Chart] = ()
    numbers: Sequence[Number] = ()
    verdict: str = ""
    doubt: bool = False
    counted: str = ""
    warnings: Sequence[str] = ()
    source: str = ""

    @property
    def figures(self) -> list[Chart]:
        """All figures, as they are numbered."""
        figures = [*self.first, *(figure for part in self.sections for figure in part.figures)]
        return [replace(figure, simulated=self.simulated) for figure in figures]


def page_html(page: ReportPage) -> str:
    """Write a page; all text is escaped."""
    script = render("page.js")
    digest = base64.b64encode(sha256(script.encode()).digest()).decode()
    html = render(
        "page.html",
        page=page,
        next_number=partial(next, count(1)),
        draw=partial(_draw, page.simulated, count()),
        css=render("page.css") + render("figure.css", looks=looks),
        script=script,
        script_digest=f"sha256-{digest}",
    )
    return str(html)


def parts_html(parts: Sequence[Part]) -> str:
    """Write parts alone, for a notebook."""
    write: Any = environment().get_template("parts.html").module
    return "".join(map(write.part, parts))


def _draw(simulated: bool, marks: count[int], figure: Chart, kind: str) -> str:
    from markupsafe import Markup  # noqa: PLC0415 - comes with Jinja2

    from rig.report.plot import page_svg  # noqa: PLC0415 - matplotlib, only where there are figures

    figure = replace(figure, simulated=simulated)
    svg = page_svg(figure, _WIDTHS[kind], kind, f"f{next(marks)}")
    return Markup(svg)  # noqa: S704 - no text of a file is in it but escaped
