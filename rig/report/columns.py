"""Result tables: their columns, for the terminal and the page alike, and as text."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rig.measurands import averaged, listed
from rig.report.numbers import fixed, nested, plus_minus, value_of
from rig.text_table import text_table

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from rig.measurands import Measurand

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


def summary_columns() -> list[Column]:
    """Columns of `summary`; unlike chains have a line each.

    Eₙ is the normalized error; within ±1 measurement and prediction agree.
    """
    return [
        Column("incline (°)", incline),
        Column("strikes", _text("impact_chain"), numeric=False),
        Column("n", _count("n")),
        *(column for row in averaged() for column in _beside_model(row)),
        Column("Eₙ", _number(1, 2, "normalized_error")),
    ]


def _beside_model(row: Measurand) -> tuple[Column, Column]:
    predicted = _number(row.scale, row.decimals, "predicted", row.name)
    return measured(row), Column(f"predicted {row.symbol} ({row.unit})", predicted)


def measured(row: Measurand) -> Column:
    """Make the column of a quantity with its U."""
    heading = f"{row.symbol} ± U ({row.unit})"
    return Column(heading, _quantity(row.scale, row.decimals, row.name))


def run_columns() -> list[Column]:
    """Columns of `runs`; raw Δz is as it happened, not corrected to simultaneous release."""
    return [
        Column("run", _count("run")),
        Column("attempt", _count("attempt")),
        Column("incline (°)", incline),
        Column("impact chain", _text("impact_chain"), numeric=False),
        *(measured(row) for row in listed()),
        Column("edges", _audit),
        Column("verdict", _text("verdict"), numeric=False),
    ]


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


def aligned(columns: Sequence[Column], records: Sequence[Record]) -> list[str]:
    """Write records as lines of aligned text below their headings; empty columns are left out."""
    columns, rows = filled(columns, records)
    return text_table([[column.heading for column in columns], *rows], rule=True)


def summary_table(analysis: Mapping[str, Any]) -> str:
    """Write the summary as aligned text.

    Parameters
    ----------
    analysis
        What ``rig analyze --json`` prints.

    Returns
    -------
    str
        Lines without an end of line at the last; one sentence where there is no summary.
    """
    summary = analysis.get("summary") or ()
    if not summary:
        return "No accepted runs, so no summary."
    return "\n".join(aligned(summary_columns(), summary))
