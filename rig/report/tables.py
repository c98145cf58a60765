"""Tables and lists of a page; all text is escaped here."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, TypeVar

from rig.report.columns import DISAGREES, filled

if TYPE_CHECKING:
    from collections.abc import Container, Iterable, Sequence

    from rig.report.columns import Column

T = TypeVar("T")

_MARKED = {"void", "rejected", "marginal", DISAGREES}
"""Words that get a colour and a weight; they say the same without."""


def table(
    name: str,
    columns: Sequence[Column[T]],
    records: Sequence[T],
    off: Container[int] = (),
    links: Sequence[str] = (),
) -> str:
    """Make a table that scrolls by itself where the page is narrow.

    Parameters
    ----------
    name
        For who hears the page.
    off
        Rows that are grey, by number.
    links
        Places on the page to which the first cell of each row leads; none where empty.
    """
    kept, rows = filled(columns, records)
    sides = [' class="num"' if column.numeric else "" for column in kept]
    head = "".join(
        f'<th scope="col"{side}>{escape(column.heading)}</th>'
        for column, side in zip(kept, sides, strict=True)
    )
    body = ""
    for number, row in enumerate(rows):
        leads = links[number] if number < len(links) else ""
        cells = "".join(
            _cell(text, side, leads if place == 0 else "")
            for place, (text, side) in enumerate(zip(row, sides, strict=True))
        )
        grey = ' class="off"' if number in off else ""
        body += f"<tr{grey}>{cells}</tr>\n"
    return scrolling(
        name, f"<table><thead><tr>{head}</tr></thead>\n<tbody>\n{body}</tbody></table>"
    )


def scrolling(name: str, html: str) -> str:
    """Wrap what may be wider than the page; the keyboard reaches it too."""
    return (
        f'<div class="scroll" role="region" aria-label="{escape(name)}" tabindex="0">{html}</div>'
    )


def paragraphs(sentences: Iterable[str], kind: str = "note") -> str:
    """Make a paragraph of each sentence."""
    return "".join(f'<p class="{kind}">{escape(sentence)}</p>' for sentence in sentences)


def bullets(sentences: Iterable[str]) -> str:
    """Make a list; nothing of nothing."""
    items = "".join(f"<li>{escape(sentence)}</li>" for sentence in sentences)
    return f"<ul>{items}</ul>" if items else ""


def _cell(text: str, side: str, leads: str) -> str:
    if text in _MARKED:
        side = f' class="{text}"'
    shown = f'<a href="#{escape(leads)}">{escape(text)}</a>' if leads else escape(text)
    return f"<td{side}>{shown}</td>"
