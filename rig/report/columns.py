"""Tables of terminal and page, as described in `columns.txt`."""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

from rig.measurands import MEASURANDS, Measurand, of_kind
from rig.report.numbers import degrees, fixed, plus_minus
from rig.text_rows import read_paragraphs
from rig.text_table import text_table

Derived = Mapping[str, Callable[[Any], Any]]
"""Functions that a table calls with ``()``, by name."""
_NOTHING: Derived = {}


@dataclass(frozen=True, slots=True)
class Part:
    """A heading, sentences, and perhaps a table.

    Attributes
    ----------
    head, rows
        Column headings, each with whether the column is numeric; the text of each row's cells.
    """

    heading: str
    sentences: Sequence[str]
    head: Sequence[tuple[str, bool]]
    rows: Sequence[Sequence[str]]

    @property
    def table(self) -> list[str]:
        """The table as lines of aligned text."""
        words = {place for place, (_, numeric) in enumerate(self.head) if not numeric}
        heading = [heading for heading, _ in self.head]
        return text_table([heading, *self.rows], left=words, rule=True) if self.rows else []

    @property
    def lines(self) -> list[str]:
        """All lines for a terminal."""
        return ["", self.heading, *self.table, *self.sentences]


def table_parts(
    name: str,
    records: Iterable[Any] = (),
    words: Iterable[str] = (),
    derived: Derived = _NOTHING,
    row: Measurand | None = None,
) -> Iterator[Part]:
    """Yield a table of ``columns.txt``, unless it is empty.

    Parameters
    ----------
    name
        Name of the table.
    words
        Further sentences.
    derived
        Functions that the table calls with ``()``, by name.
    row
        The measurand of all records; if not given, each record may have its own.
    """
    records, table = list(records), TABLES[name]
    written = partial(str.format, row=row, first=records[0] if records else None)
    columns = [
        (
            (written(heading, row=kind).strip('"'), way.split()[0] not in _WORDS),
            [_cell(place, way, kind, derived, record) for record in records],
        )
        for heading, place, way, *each in table.rows
        for kind in (of_kind(each[0].removeprefix("each ")) if each else [row])
    ]
    columns = [(head, cells) for head, cells in columns if any(cells)]
    if records or words:
        sentences = [written(table.words), *words] if table.words else list(words)
        heading = written(table.heading)
        # Not for headings that begin with a symbol: g is not G.
        heading = heading[:1].upper() + heading[1:]
        rows = [*zip(*(cells for _, cells in columns), strict=True)]
        yield Part(heading, sentences, [head for head, _ in columns], rows)


def records_in(name: str, whole: Any) -> list[Any]:
    """Return a table's records by the path in its heading; for groups, each with each member."""
    place, _, members = TABLES[name].place.partition("*")
    records = value_at(whole, place) or () if place else ()
    if members:
        return [(group, member) for group in records for member in getattr(group, members)]
    return [*records]


class _Table(NamedTuple):
    heading: str
    words: str
    rows: list[list[str]]
    place: str = ""


def read_tables(module: str, file: str = "") -> Iterator[tuple[str, _Table]]:
    """Yield names and tables of a file such as ``columns.txt`` beside a module."""
    for lines in read_paragraphs(module, file):
        (_, name, heading, *place), *rows = (re.split(r"^\[|\] | {2,}", line) for line in lines)
        words = " ".join(row[0] for row in rows if len(row) == 1)
        yield name, _Table(heading, words, [row for row in rows if len(row) > 1], *place)


def _cell(place: str, way: str, row: Measurand | None, derived: Derived, record: Any) -> str:
    own = record.get if isinstance(record, Mapping) else partial(getattr, record)
    row = row or own("row", None) or MEASURANDS.get(own("quantity", ""))
    value = value_at(record, place.format(row=row), derived)
    way, *numbers = way.split()
    return _WAYS[way](value, row, *map(float, numbers))


def value_at(record: Any, place: str, derived: Derived = _NOTHING) -> Any:
    """Return the value at a path such as ``run.incline_deg`` or ``0.edges()``; ``-`` is the record.

    `None` has no further parts. A mapping inside a record may lack a key; the record itself only if
    the path ends with ``?``, as in ``impact_chain?``.

    Raises
    ------
    AttributeError, KeyError
        A record has no such attribute or key: otherwise a column would be lost silently.
    """
    value = record
    for step in place.split("."):
        name, call, _ = step.partition("()")
        if value is None or name == "-":
            break
        if call:
            value = derived[name](value)
        elif isinstance(value, Mapping):
            key = name.removesuffix("?")
            value = value[key] if value is record and key == name else value.get(key)
        else:
            value = value[int(name)] if name.isdigit() else getattr(value, name)
    return value


def _text(value: object, *_: object) -> str:
    return "" if value is None else str(value)


def _verdict(error: float | None, *_: object) -> str:
    """Return a normalized error in words; empty without a comparison."""
    return "" if error is None else "agrees" if abs(error) <= 1.0 else "disagrees"


TABLES = dict(read_tables(__file__))
"""Tables of ``columns.txt`` by name."""
_WORDS = ("words", "verdict", "quantity", "symbol")
"""Formats of columns without numbers."""
_WAYS: dict[str, Callable[..., str]] = {
    "words": _text,
    "text": _text,
    "verdict": _verdict,
    "quantity": lambda _, row: f"{row.symbol} ({row.fine})",
    "symbol": lambda name, _: MEASURANDS[name].symbol,
    "degrees": lambda value, _: degrees(value),
    "times": lambda value, _: f"× {value:.2f}",
    "p": lambda value, _: "" if value is None else f"{value:.2g}",
    "fixed": lambda value, _, decimals, scale=1.0: fixed(value and value * scale, int(decimals)),
    "fine": lambda value, row: fixed(value and value * row.fine_scale, row.fine_decimals),
    "plus_minus": lambda value, _, scale=1.0: plus_minus(value, scale),
    "usual": lambda value, row, more=0: plus_minus(value, row.scale, row.decimals + int(more)),
    "small": lambda value, row: plus_minus(value, row.fine_scale, row.fine_decimals),
}
