"""Pages: a template and what it asks for, with figures that are drawn as they are named."""

from __future__ import annotations

import base64
from dataclasses import replace
from hashlib import sha256
from typing import TYPE_CHECKING, Any

from rig.report import looks
from rig.report.figure import COLUMN_PT, WIDE_PT
from rig.report.templates import environment, render

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rig.report.columns import Part
    from rig.report.figure import Chart

_WIDTHS = {"slim": COLUMN_PT, "wide": WIDE_PT}
"""A figure is drawn for a telephone and for a page; whichever has room is shown."""


def page_html(page: Mapping[str, Any]) -> tuple[str, list[Chart]]:
    """Write a page; all text is escaped.

    Parameters
    ----------
    page
        Its `template`, its `title`, whether it is `simulated`, and what its template asks for.

    Returns
    -------
    html, figures
        The page, and all its figures as they are numbered.
    """
    figures: list[Chart] = []
    marks: list[str] = []

    def draw(chart: Chart, kind: str) -> str:
        from markupsafe import Markup  # noqa: PLC0415 - comes with Jinja2

        from rig.report.plot import page_svg  # noqa: PLC0415 - matplotlib, only for figures

        chart = replace(chart, simulated=page["simulated"])
        marks.append(f"f{len(marks)}")
        svg = page_svg(chart, _WIDTHS[kind], kind, marks[-1])
        return Markup(svg)  # noqa: S704 - no text of a file is in it but escaped

    def number(chart: Chart) -> int:
        figures.append(replace(chart, simulated=page["simulated"]))
        return len(figures)

    script = render("page.js")
    digest = base64.b64encode(sha256(script.encode()).digest()).decode()
    html = render(
        "page.html",
        **page,
        draw=draw,
        number=number,
        css=render("page.css") + render("figure.css", looks=looks),
        script=script,
        script_digest=f"sha256-{digest}",
    )
    return str(html), figures


def parts_html(parts: Sequence[Part]) -> str:
    """Write parts alone, for a notebook."""
    write: Any = environment().get_template("parts.html").module
    return "".join(map(write.part, parts))
