"""Templates of pages, texts and sentences; a page draws the figures that it names."""

from __future__ import annotations

import base64
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from markupsafe import Markup, escape

from rig import measurands
from rig.reasons import sentences
from rig.report import looks, numbers
from rig.report.columns import Part
from rig.report.figure import COLUMN_PT, WIDE_PT, Chart

if TYPE_CHECKING:
    from jinja2 import Environment


_CODE = re.compile("`([^`]*)`")
_WIDTHS = {"slim": COLUMN_PT, "wide": WIDE_PT}
"""Widths of a figure for telephone and page, points; the page shows the one that fits."""


@cache
def environment() -> Environment:
    """Return the template environment, which escapes all text."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined  # noqa: PLC0415 - pages only

    loader = FileSystemLoader(Path(__file__).parent)
    templates = Environment(loader=loader, autoescape=True, undefined=StrictUndefined)
    writers = numbers.plus_minus, numbers.with_unit, numbers.signed, numbers.fixed, sentences
    templates.filters |= {write.__name__: write for write in writers} | {"prose": _prose}
    templates.globals |= {"numbers": numbers, "looks": looks, "measurands": measurands}
    return templates


def render(name: str, **values: object) -> str:
    """Return a template filled with values.

    Returns
    -------
    Markup
        Text that other templates do not escape again.
    """
    return escape(environment().get_template(name).make_module(values))


def sentence(name: str, *values: object) -> str:
    """Return a sentence of ``words.txt``."""
    write = getattr(environment().get_template("words.txt").module, name)
    return str(write(*values).unescape())  # for a terminal too


def lines(name: str, *values: object) -> list[str]:
    """Return sentences of ``words.txt``, a line each, without empty ones."""
    return [line for line in sentence(name, *values).split("\n") if line]


def parts_html(parts: Sequence[Part]) -> str:
    """Return parts as HTML without a page, for a notebook."""
    write: Any = environment().get_template("parts.html").module
    return "".join(map(write.part, parts))


def page_html(page: Mapping[str, Any]) -> tuple[str, list[Chart]]:
    """Return a page as HTML; all text is escaped.

    Parameters
    ----------
    page
        Its `template`, its `title`, whether it is `simulated`, and the template's data.

    Returns
    -------
    html, figures
        The page, and all its figures in the order of their numbers.
    """
    figures: list[Chart] = []

    def number(chart: Chart) -> int:
        figures.append(replace(chart, simulated=page["simulated"]))
        return len(figures)

    def draw(kind: str) -> str:
        """Return the latest figure as SVG."""
        from rig.report.plot import page_svg  # noqa: PLC0415 - matplotlib, only for figures

        svg = page_svg(figures[-1], _WIDTHS[kind], kind, f"{kind[0]}{len(figures)}")
        return Markup(svg)  # noqa: S704 - all text of files in it is escaped

    known = {**page, **read_script("page.js"), "number": number, "draw": draw}
    return str(render("page.html", **known)), figures


def read_script(name: str) -> dict[str, str]:
    """Return a page's ``script``, and its ``digest`` for the page's security policy."""
    script = render(name)
    digest = base64.b64encode(sha256(script.encode()).digest()).decode()
    return {"script": script, "digest": f"sha256-{digest}"}


def _prose(sentence: str) -> str:
    """Return a sentence escaped, with keys and commands in code type."""
    return Markup(_CODE.sub(r"<code>\1</code>", str(escape(sentence))))  # noqa: S704 - just escaped
