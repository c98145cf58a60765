"""A page as plain data: its card, its sections as rows, and the one template that writes them."""

from __future__ import annotations

import base64
from dataclasses import dataclass, field
from hashlib import sha256
from typing import TYPE_CHECKING, Any, NamedTuple

from rig.report import looks
from rig.report.columns import DISAGREES, filled
from rig.report.layout import COLUMN_PT, WIDE_PT, lay_out
from rig.report.svg import figure_svg
from rig.report.templates import environment, render

if TYPE_CHECKING:
    from collections.abc import Container, Mapping, Sequence

    from rig.report.columns import Column
    from rig.report.figure import Chart
    from rig.report.finding import Number
    from rig.report.parts import Part

_MARKED = ("void", "rejected", "marginal", DISAGREES)
"""Words that get a colour and a weight; they say the same without."""


class TableRow(NamedTuple):
    """Cells of a table's row, whether it is grey, and where its first cell leads on the page."""

    cells: list[str]
    off: bool = False
    link: str = ""


class FilledTable(NamedTuple):
    """A filled table: its name for who hears the page, headings, and rows."""

    name: str
    head: list[tuple[str, bool]]
    rows: list[TableRow]


@dataclass(frozen=True, slots=True)
class PageSection:
    """One section: what it claims, then its figures, and what only a referee wants below.

    Attributes
    ----------
    parts, referee
        Tables and sentences, shown and folded.
    drops, method
        What `drops.html` and `method.html` ask for; empty leaves them out.
    facts, protocol
        Names with values, and a file with its text, folded too.
    """

    anchor: str
    heading: str
    claims: Sequence[str] = ()
    figures: Sequence[Chart] = ()
    parts: Sequence[Part] = ()
    referee: Sequence[Part] = ()
    drops: Mapping[str, Any] = field(default_factory=dict)
    method: Mapping[str, Any] = field(default_factory=dict)
    facts: Sequence[tuple[str, str]] = ()
    protocol: tuple[str, str] | None = None


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
    first: Chart | None = None
    numbers: Sequence[Number] = ()
    verdict: str = ""
    doubt: bool = False
    counted: str = ""
    warnings: Sequence[str] = ()
    source: str = ""

    @property
    def figures(self) -> list[Chart]:
        """All figures, as they are numbered."""
        first = [self.first] if self.first else []
        return first + [figure for section in self.sections for figure in section.figures]


def page_html(page: ReportPage) -> str:
    """Write a page; all text is escaped."""
    numbered = enumerate(map(_drawn, page.figures), 1)
    first = next(numbered)[1] if page.first else None
    sections = [
        {
            **{name: getattr(section, name) for name in PageSection.__slots__},
            "figures": [next(numbered) for _ in section.figures],
            "parts": [*map(_filled_part, section.parts)],
            "referee": [*map(_filled_part, section.referee)],
        }
        for section in page.sections
    ]
    script = render("page.js")
    digest = base64.b64encode(sha256(script.encode()).digest()).decode()
    shown = {name: getattr(page, name) for name in ReportPage.__slots__}
    html = render(
        "page.html",
        page={**shown, "first": first, "sections": sections},
        css=render("page.css") + render("figure.css", looks=looks),
        script=script,
        script_digest=f"sha256-{digest}",
        marked=_MARKED,
    )
    return str(html)


def parts_html(parts: Sequence[Part]) -> str:
    """Write parts alone, for a notebook."""
    write: Any = environment().get_template("parts.html").make_module({"marked": _MARKED})
    return "".join(write.part(_filled_part(part)) for part in parts)


def filled_table(
    name: str,
    columns: Sequence[Column[Any]],
    records: Sequence[Any],
    off: Container[int] = (),
    links: Mapping[int, str] | None = None,
) -> FilledTable:
    """Fill a table; `off` are numbers of grey rows, `links` places to which first cells lead."""
    kept, rows = filled(columns, records)
    return FilledTable(
        name,
        [(column.heading, column.numeric) for column in kept],
        [TableRow(cells, n in off, (links or {}).get(n, "")) for n, cells in enumerate(rows)],
    )


def _drawn(figure: Chart) -> dict[str, str]:
    """Draw a figure for a telephone and for a page; whichever has room is shown."""
    slim = figure_svg(lay_out(figure, COLUMN_PT), figure.title, "slim")
    wide = figure_svg(lay_out(figure, WIDE_PT), figure.title, "wide")
    return {"caption": figure.caption, "slim": slim, "wide": wide}


def _filled_part(part: Part) -> dict[str, Any]:
    table = filled_table(part.heading or "table", part.columns, part.records)
    return {
        "heading": part.heading,
        "sentences": part.sentences,
        "bullets": part.bullets,
        "table": table if part.records else None,
    }
