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


def filled(
    columns: Sequence[Column[T]], records: Sequence[T]
) -> tuple[list[Column[T]], list[list[str]]]:
    """Fill a table; columns in which no record has anything are left out."""
    cells = [[column.cell(record) for record in records] for column in columns]
    present = [(column, texts) for column, texts in zip(columns, cells, strict=True) if any(texts)]
    rows = zip(*(texts for _, texts in present), strict=True)
    return [column for column, _ in present], [list(row) for row in rows]


def aligned(columns: Sequence[Column[T]], records: Sequence[T]) -> list[str]:
    """Write records as lines of aligned text below their headings."""
    present, rows = filled(columns, records)
    words = {place for place, column in enumerate(present) if not column.numeric}
    heading = [column.heading for column in present]
    return text_table([heading, *rows], left=words, rule=True) if rows else []
