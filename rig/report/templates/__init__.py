"""Pages, texts and sentences, each a template here; a page draws the figures it names."""

from __future__ import annotations

import base64
import re
from dataclasses import replace
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from markupsafe import Markup, escape

from rig import measurands
from rig.reasons import sentences
from rig.report import looks, numbers
from rig.report.figure import COLUMN_PT, WIDE_PT

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from jinja2 import Environment

    from rig.report.columns import Part
    from rig.report.figure import Chart

_CODE = re.compile("`([^`]*)`")
_WIDTHS = {"slim": COLUMN_PT, "wide": WIDE_PT}
"""A figure is drawn for a telephone and for a page; whichever has room is shown."""


@cache
def environment() -> Environment:
    """Return the templates; they escape all text."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined  # noqa: PLC0415 - pages only

    loader = FileSystemLoader(Path(__file__).parent)
    templates = Environment(loader=loader, autoescape=True, undefined=StrictUndefined)
    writers = numbers.plus_minus, numbers.with_unit, numbers.signed, numbers.fixed, sentences
    templates.filters |= {write.__name__: write for write in writers} | {"prose": _prose}
    templates.globals |= {"numbers": numbers, "looks": looks, "measurands": measurands}
    return templates


def render(name: str, **values: object) -> str:
    """Fill a template.

    Returns
    -------
    Markup
        Which other templates need not escape.
    """
    return Markup(environment().get_template(name).render(values))  # noqa: S704 - just escaped


def sentence(name: str, *values: object) -> str:
    """Write a sentence of ``words.txt``."""
    write = getattr(environment().get_template("words.txt").module, name)
    return Markup(write(*values)).unescape()  # noqa: S704 - for a terminal too


def lines(name: str, *values: object) -> list[str]:
    """Write sentences of ``words.txt``, a line each; none where there is nothing to say."""
    return [line for line in sentence(name, *values).split("\n") if line]


def parts_html(parts: Sequence[Part]) -> str:
    """Write parts alone, for a notebook."""
    write: Any = environment().get_template("parts.html").module
    return "".join(map(write.part, parts))


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

    def number(chart: Chart) -> int:
        figures.append(replace(chart, simulated=page["simulated"]))
        return len(figures)

    def draw(kind: str) -> str:
        """Draw the latest figure."""
        from rig.report.plot import page_svg  # noqa: PLC0415 - matplotlib, only for figures

        svg = page_svg(figures[-1], _WIDTHS[kind], kind, f"{kind[0]}{len(figures)}")
        return Markup(svg)  # noqa: S704 - no text of a file is in it but escaped

    script = render("page.js")
    digest = base64.b64encode(sha256(script.encode()).digest()).decode()
    known = {**page, "number": number, "draw": draw, "script": script, "digest": digest}
    return str(render("page.html", **known)), figures


def _prose(sentence: str) -> str:
    """Escape a sentence, and set its keys and commands in code type."""
    return Markup(_CODE.sub(r"<code>\1</code>", str(escape(sentence))))  # noqa: S704 - just escaped
