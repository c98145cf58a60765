"""The columns of result tables, for the terminal and the page alike."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rig.report.numbers import fixed, nested, plus_minus, value_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    Record = Mapping[str, Any]
    Cell = Callable[[Record], str]


AUDIT = ("received", "matched", "missed", "spurious", "lost")
"""Counts of edges in the order in which the runs table gives them."""


@dataclass(frozen=True, slots=True)
class Column:
    """A heading with its unit, and how a record fills the cell."""

    heading: str
    cell: Cell
    numeric: bool = True


def _quantity(scale: float, decimals: int, *path: str) -> Cell:
    return lambda record: plus_minus(nested(record, *path), scale, decimals)


def _number(scale: float, decimals: int, *path: str) -> Cell:
    def cell(record: Record) -> str:
        value = value_of(nested(record, *path))
        return "" if value is None else fixed(value * scale, decimals)

    return cell


def _count(*path: str) -> Cell:
    return _number(1, 0, *path)


def _text(key: str) -> Cell:
    return lambda record: str(record.get(key) or "")


def incline(record: Record) -> str:
    """Write a record's inclination; nothing where nothing is struck, so nothing is inclined."""
    value = value_of(record.get("incline_deg"))
    if value is None or "gravity_m_s2" in record or record.get("impact_chain", "") is None:
        return ""
    return f"{value:g}".replace("-", "−")


def _audit(record: Record) -> str:
    counts = [fixed(value_of(nested(record, "edges", kind)), 0) for kind in AUDIT]
    return " / ".join(count or "–" for count in counts) if any(counts) else ""


SUMMARY = (
    Column("incline (°)", incline),
    Column("strikes", _text("impact_chain"), numeric=False),
    Column("n", _count("n")),
    Column("Δz ± U (cm)", _quantity(100, 2, "separation_m")),
    Column("predicted Δz (cm)", _number(100, 2, "predicted", "separation_m")),
    Column("V ± U (m/s)", _quantity(1, 3, "speed_m_s")),
    Column("predicted V (m/s)", _number(1, 3, "predicted", "speed_m_s")),
    Column("g ± U (m/s²)", _quantity(1, 4, "gravity_m_s2")),
    Column("predicted g (m/s²)", _number(1, 4, "predicted", "gravity_m_s2")),
    Column("Eₙ", _number(1, 2, "normalized_error")),
)
"""Of `summary`. Unlike chains have a line each.

Eₙ is the normalized error; within ±1 measurement and prediction agree.
"""

RUNS = (
    Column("run", _count("run")),
    Column("attempt", _count("attempt")),
    Column("incline (°)", incline),
    Column("impact chain", _text("impact_chain"), numeric=False),
    Column("Δz ± U (cm)", _quantity(100, 2, "separation_m")),
    Column("raw Δz ± U (cm)", _quantity(100, 2, "separation_raw_m")),
    Column("V ± U (m/s)", _quantity(1, 3, "speed_m_s")),
    Column("skew ± U (ms)", _quantity(1000, 2, "release_skew_s")),
    Column("g ± U (m/s²)", _quantity(1, 4, "gravity_m_s2")),
    Column("edges", _audit),
    Column("verdict", _text("verdict"), numeric=False),
)
"""Of `runs`. Raw Δz is as it happened, not corrected to simultaneous release."""


def filled(
    columns: Sequence[Column], records: Sequence[Record]
) -> tuple[list[Column], list[list[str]]]:
    """Fill a table and leave out the columns in which no record has anything.

    Returns
    -------
    columns, rows
        The columns that stay, and the text of their cells for each record.
    """
    table = [[column.cell(record) for column in columns] for record in records]
    kept = [index for index in range(len(columns)) if any(row[index] for row in table)]
    return [columns[index] for index in kept], [[row[index] for index in kept] for row in table]
