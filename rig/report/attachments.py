"""Files that a page carries inside itself, to be saved by whoever reads it."""

from __future__ import annotations

import base64
import io
import zipfile
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

_EPOCH = (1980, 1, 1, 0, 0, 0)
"""The first date that the format knows: the same files shall give the same bytes."""


@dataclass(frozen=True, slots=True)
class Attachment:
    """A file inside a page.

    Attributes
    ----------
    name
        Under which it is saved.
    kind
        Its media type.
    content
        Its bytes.
    words
        What is in it.
    """

    name: str
    kind: str
    content: bytes
    words: str


def zipped(files: Mapping[str, str]) -> bytes:
    """Pack texts as UTF-8; the same texts give the same bytes."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, text in files.items():
            info = zipfile.ZipInfo(name, _EPOCH)
            info.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(info, text.encode("utf-8", "replace"))
    return packed.getvalue()


def link(one: Attachment) -> str:
    """Return a link that saves a file; the page needs no other place for it."""
    data = base64.b64encode(one.content).decode("ascii")
    size = max(1, round(len(one.content) / 1000))
    return (
        f'<a download="{escape(one.name)}" href="data:{escape(one.kind)};base64,{data}">'
        f"{escape(one.name)}</a> ({size} kB): {escape(one.words)}"
    )
