"""Tables of studies: a heading and how a record fills the cell, as text."""

from __future__ import annotations

from typing import TYPE_CHECKING, Generic, NamedTuple, TypeVar

from rig.text_table import text_table

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

T = TypeVar("T")


class Column(NamedTuple, Generic[T]):
    """A heading with its unit, and how a record fills the cell."""

    heading: str
    cell: Callable[[T], str]
    numeric: bool = True


def aligned(columns: Sequence[Column[T]], records: Sequence[T]) -> list[str]:
    """Write records as lines of aligned text below their headings; none of no records."""
    rows = [[column.cell(record) for column in columns] for record in records]
    words = {place for place, column in enumerate(columns) if not column.numeric}
    heading = [column.heading for column in columns]
    return text_table([heading, *rows], left=words, rule=True) if rows else []
