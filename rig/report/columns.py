"""Tables: their columns, for the terminal and the page alike, and as text."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeVar

from rig.analysis.result import Measured
from rig.measurands import MEASURANDS
from rig.report.numbers import degrees, fixed, plus_minus
from rig.text_table import text_table

if TYPE_CHECKING:
    from collections.abc import Container, Iterable, Iterator, Sequence

    from rig.measurands import Measurand

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Column(Generic[T]):
    """A heading with its unit, and how a record fills the cell."""

    heading: str
    cell: Callable[[T], str]
    numeric: bool = True


@dataclass(frozen=True, slots=True)
class Part:
    """A heading, sentences or bullets, and perhaps a table.

    Attributes
    ----------
    head, rows
        Headings of columns and whether they are of numbers; the text of each row's cells.
    off, links
        Rows that do not count, and where the first cells of rows lead on the page.
    """

    heading: str
    sentences: Sequence[str] = ()
    head: Sequence[tuple[str, bool]] = ()
    rows: Sequence[Sequence[str]] = ()
    bullets: bool = False
    off: Container[int] = ()
    links: Mapping[int, str] = field(default_factory=dict)

    @property
    def table(self) -> list[str]:
        """The table as lines of aligned text."""
        words = {place for place, (_, numeric) in enumerate(self.head) if not numeric}
        heading = [heading for heading, _ in self.head]
        return text_table([heading, *self.rows], left=words, rule=True) if self.rows else []

    @property
    def lines(self) -> list[str]:
        """All of it, for a terminal."""
        return ["", self.heading, *self.table, *self.sentences]


def table_parts(
    name: str,
    records: Iterable[Any] = (),
    words: Iterable[str] = (),
    row: Measurand | None = None,
    **derived: Callable[[Any], Any],
) -> Iterator[Part]:
    """Yield a table of ``columns.txt``; nothing where there is nothing to say.

    Parameters
    ----------
    name
        Of the table there.
    words
        Said of it too.
    row
        The measurand of all its records; without it each record has its own, or none.
    derived
        What the table calls with ``()``, by name.
    """
    records, table = list(records), _TABLES[name]
    written = partial(str.format, row=row, first=records[0] if records else None)
    columns = [
        Column(
            written(heading, row=kind).strip('"'),
            partial(_cell, place, way, kind, derived),
            way.split()[0] not in _WORDS,
        )
        for heading, place, way, *each in table.rows
        for kind in (_kinds(each[0]) if each else [row])
    ]
    if records or words:
        sentences = [written(table.words), *words] if table.words else list(words)
        yield filled_part(raised(written(table.heading)), columns, records, sentences)


def raised(text: str) -> str:
    """Begin text with a capital; not for what begins with a symbol, since g is not G."""
    return text[:1].upper() + text[1:]


def filled_part(
    heading: str, columns: Sequence[Column[T]], records: Sequence[T], sentences: Sequence[str] = ()
) -> Part:
    """Fill a table."""
    columns, rows = filled(columns, records)
    return Part(heading, sentences, [(each.heading, each.numeric) for each in columns], rows)


def filled(
    columns: Sequence[Column[T]], records: Sequence[T]
) -> tuple[list[Column[T]], list[list[str]]]:
    """Fill a table and leave out the columns in which no record has anything.

    Returns
    -------
    columns, rows
        The columns that stay, and the text of their cells for each record.
    """
    table = [[column.cell(record) for column in columns] for record in records]
    kept = [index for index in range(len(columns)) if any(row[index] for row in table)]
    return [columns[index] for index in kept], [[row[index] for index in kept] for row in table]


def aligned(columns: Sequence[Column[T]], records: Sequence[T]) -> list[str]:
    """Write records as lines of aligned text below their headings; empty columns are left out."""
    return filled_part("", columns, records).table


class _Table(NamedTuple):
    heading: str
    words: str
    rows: list[list[str]]


def read_tables(text: str) -> Iterator[tuple[str, _Table]]:
    """Yield names with what stands below them in a file such as ``columns.txt``."""
    for block in text.split("\n[")[1:]:
        (name, heading), *rows = (
            re.split(r"\] | {2,}", line) for line in block.strip().split("\n")
        )
        words = " ".join(row[0] for row in rows if len(row) == 1)
        yield name, _Table(heading, words, [row for row in rows if len(row) > 1])


def _kinds(each: str) -> list[Measurand]:
    return [row for row in MEASURANDS.values() if getattr(row, each.removeprefix("each "))]


def _cell(
    place: str,
    way: str,
    row: Measurand | None,
    derived: Mapping[str, Callable[[Any], Any]],
    record: Any,
) -> str:
    row, value = row or _member(record, "row"), record
    for step in place.format(row=row).split("."):
        name, call, _ = step.partition("()")
        value = derived[name](value) if call else _member(value, name)
    way, *numbers = way.split()
    return _WAYS[way](value, row, *map(float, numbers))


def _member(record: Any, name: str) -> Any:
    return record.get(name) if isinstance(record, Mapping) else getattr(record, name, None)


def _text(value: object, *_: object) -> str:
    return "" if value is None else str(value)


def _fixed(value: float | None, _: object, decimals: float, scale: float = 1.0) -> str:
    return "" if value is None else fixed(scale * value, int(decimals))


def _verdict(error: float | None, *_: object) -> str:
    """Say what a normalized error means; nothing where nothing was compared."""
    return "" if error is None else "agrees" if abs(error) <= 1.0 else "disagrees"


def _predicted(model: Any, row: Measurand) -> str:
    """Write what the model says; one that knows its numbers exactly has no ±."""
    if model is None or not model.u:
        return fixed(model and model.value * row.scale, row.decimals)
    return plus_minus(Measured(model.value, model.u), row.scale)


_TABLES = dict(read_tables(Path(__file__).with_suffix(".txt").read_text("utf-8")))
_WORDS = ("words", "verdict", "quantity", "symbol")
"""Ways that write no numbers."""
_WAYS: dict[str, Callable[..., str]] = {
    "words": _text,
    "text": _text,
    "verdict": _verdict,
    "quantity": lambda row, _: f"{row.symbol} ({row.fine})",
    "symbol": lambda name, _: MEASURANDS[name].symbol,
    "degrees": lambda value, _: degrees(value),
    "times": lambda value, _: f"× {value:.2f}",
    "p": lambda value, _: "" if value is None else f"{value:.2g}",
    "fixed": _fixed,
    "fine": lambda value, row: _fixed(value, row, row.fine_decimals, row.fine_scale),
    "predicted": _predicted,
    "plus_minus": lambda value, _, scale=1.0: plus_minus(value, scale),
    "usual": lambda value, row: plus_minus(value, row.scale, row.decimals),
    "small": lambda value, row: plus_minus(value, row.fine_scale, row.fine_decimals),
}
