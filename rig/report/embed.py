"""SVG figures inside a page: unique names, and colours that follow the reader's scheme."""

from __future__ import annotations

import re
from dataclasses import dataclass
from html import escape

from rig.report.canvas import INK, MODEL, MODEL_BAND, MUTED, PAPER, RULE, SECOND
from rig.report.tables import scrolling

_DARK = {
    INK: "#e6e9ed",
    MUTED: "#98a2ad",
    RULE: "#363d46",
    PAPER: "#15191e",
    MODEL: "#4db3ec",
    MODEL_BAND: "#123c55",
    SECOND: "#ff8c42",
}
"""The same contrasts on a dark page."""
_WIDTH = re.compile(r'<svg [^>]*\bwidth="([0-9.]+)pt"')
_PAGE_PT = 1.46
"""Pixels of the page for a point of a figure: its type is then as large as the page's notes."""
_NAME = re.compile(r'(\bid="|\bxlink:href="#|url\(#)')


@dataclass(frozen=True, slots=True)
class PageFigure:
    """A figure for the report: its SVG text, what it shows, the caption below, and its chapter."""

    svg: str
    alt: str
    caption: str
    place: str = "results"


def dark_figure_css() -> str:
    """Return rules that turn embedded figures dark on a dark screen.

    The SVG itself keeps its light colours, so that paper, and programs that make PDF files out of
    pages, show it as it is; ``!important`` is what beats the styles inside it. No rule names what
    is around: markers are drawn through ``<use>``, in trees of their own.
    """
    rules = "".join(
        f'[style*="{what}: {light}"] {{ {what}: {dark} !important; }}\n'
        for light, dark in _DARK.items()
        for what in ("fill", "stroke")
    )
    return f"@media screen and (prefers-color-scheme: dark) {{\n{rules}}}\n"


def embedded(picture: PageFigure, number: int) -> str:
    """Return a ``<figure>`` with the SVG inline.

    Parameters
    ----------
    picture
        SVG as the figure functions make it.
    number
        Of the figure on the page, from 1; it keeps names of several figures apart.
    """
    svg = picture.svg[max(picture.svg.find("<svg"), 0) :].strip()  # no XML prologue inside HTML
    svg = re.sub(r"<metadata>.*?</metadata>\s*", "", svg, flags=re.DOTALL)
    svg = _NAME.sub(rf"\1f{number}-", svg)
    wide = _WIDTH.search(svg)
    size = f' style="--wide: {float(wide[1]) * _PAGE_PT / 16:.1f}rem"' if wide else ""
    svg = svg.replace("<svg ", f'<svg role="img" aria-label="{escape(picture.alt)}"{size} ', 1)
    return (
        f"<figure>{scrolling(picture.alt, svg)}<figcaption><strong>Figure {number}.</strong> "
        f"{escape(picture.caption)}</figcaption></figure>"
    )
