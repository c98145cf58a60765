"""A section of a report, for the page and the terminal alike."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rig.report.columns import Column


@dataclass(frozen=True, slots=True)
class Part:
    """A heading, sentences, and perhaps a table.

    Attributes
    ----------
    folded
        What a long table is called while it is folded away; empty shows it.
    """

    heading: str
    sentences: Sequence[str] = ()
    columns: Sequence[Column] = ()
    records: Sequence[Mapping[str, Any]] = ()
    folded: str = ""
