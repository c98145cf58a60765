"""Files attached to a page for its readers, within a limit of size."""

import base64
from collections.abc import Iterable
from typing import NamedTuple

from rig.bundle.archive import zip_files
from rig.bundle.tables import csv_files
from rig.ready import find_resource
from rig.records import Drop
from rig.report.templates import sentence
from rig.results.whole import SessionResults
from rig.session.reading import Reader

METHOD = "method.md"
_DATA = 120_000
"""Most bytes of an attached file, so that the page of 108 drops stays under 0.8 MB."""
_ROWS = 5_000
"""Edges and pings whose tables take as much: with budgets of drops 22 to 24 bytes each, packed."""
_LARGE = ("edges.csv", "budget.csv", "pings.csv")


class Attachment(NamedTuple):
    """A file inside a page: name, media type, encoded bytes and description."""

    name: str
    kind: str
    data: str
    words: str


def attachments(
    session: Reader, outcome: SessionResults, drops: Iterable[Drop]
) -> list[Attachment]:
    """Return a session's tables as attachments, without those too large for a page."""
    few = sum(len(drop.edges) for drop in drops) + len(session.pings()) <= _ROWS
    tables = csv_files(session, outcome, () if few else _LARGE)
    tables |= {"protocol.yaml": session.protocol_text}
    contents = {name: text.encode("utf-8", "replace") for name, text in tables.items()}
    own = (file for file in session.attached_files() if len(file.data) <= _DATA)
    rows = [
        ("data.zip", "application/zip", zip_files(contents), sentence("tables", few)),
        ("summary.csv", "text/csv", contents["summary.csv"], "means only"),
        (METHOD, "text/markdown", method_page().encode(), "the whole method"),
        *((f.name, "application/octet-stream", f.data, f"attached {f.added}") for f in own),
    ]
    return [
        Attachment(name, kind, base64.b64encode(content).decode("ascii"), words)
        for name, kind, content, words in rows
    ]


def method_page() -> str:
    """Return the page on the method as Markdown, which is part of the program."""
    return find_resource(f"docs/{METHOD}").read_text("utf-8")
