"""What a page carries inside itself, to be saved by whoever reads it, as far as it stays small."""

from __future__ import annotations

import base64
import io
import zipfile
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from rig.bundle.tables import csv_files
from rig.results import tick_rates

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rig.results import SessionResults
    from rig.session.reading import Reader

METHOD = "method.md"
_DATA = 120_000
"""Bytes of packed tables at most, so that the page of 108 drops stays under 0.8 MB."""
_EPOCH = (1980, 1, 1, 0, 0, 0)
"""The first date that the format knows: the same files shall give the same bytes."""
_LARGE = ("edges.csv", "budget.csv", "pings.csv")


class Attachment(NamedTuple):
    """A file inside a page: its name, media type, bytes in letters, and what is in it."""

    name: str
    kind: str
    data: str
    words: str


def attachments(session: Reader, outcome: SessionResults) -> list[Attachment]:
    """Pack a session's tables; without those that are too many for a page to carry."""
    tables = csv_files(session, outcome.json(), tick_rates(session))
    tables |= {"protocol.yaml": session.protocol_text}
    words = "results, budgets and edges as CSV files, with the protocol"
    packed = zipped(tables)
    if len(packed) > _DATA:
        words = "results as CSV files, with the protocol; rig export also writes budgets and edges"
        packed = zipped({name: text for name, text in tables.items() if name not in _LARGE})
    return [
        Attachment(name, kind, base64.b64encode(content).decode("ascii"), words)
        for name, kind, content, words in (
            ("data.zip", "application/zip", packed, words),
            ("summary.csv", "text/csv", tables["summary.csv"].encode(), "means only"),
            (METHOD, "text/markdown", method_page().encode(), "the whole method"),
            *(
                (file.name, "application/octet-stream", file.data, f"attached {file.added}")
                for file in session.attached_files()
                if len(file.data) <= _DATA
            ),
        )
    ]


def zipped(texts: Mapping[str, str]) -> bytes:
    """Pack texts as UTF-8; the same texts give the same bytes."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, text in texts.items():
            info = zipfile.ZipInfo(name, _EPOCH)
            info.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(info, text.encode("utf-8", "replace"))
    return packed.getvalue()


def method_page() -> str:
    """Return the page on the method as Markdown; it travels with the program."""
    packed = files("rig.report").joinpath(METHOD)
    if packed.is_file():
        return packed.read_text(encoding="utf-8")
    return Path(__file__).parents[2].joinpath("docs", METHOD).read_text(encoding="utf-8")
