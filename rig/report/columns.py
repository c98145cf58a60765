"""Result tables: their columns, for the terminal and the page alike, and as text."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Generic, TypeVar

from rig.analysis.result import Audit
from rig.measurands import acceleration_in, averaged, listed
from rig.report.numbers import MINUS, fixed, plus_minus, value_of
from rig.text_table import text_table

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from rig.analysis.result import DropResult, Measured
    from rig.analysis.summary import Incline
    from rig.measurands import Measurand

T = TypeVar("T")

AUDIT = tuple(field.name for field in fields(Audit))
"""Counts of edges in the order in which the runs table gives them."""


@dataclass(frozen=True, slots=True)
class Column(Generic[T]):
    """A heading with its unit, and how a record fills the cell."""

    heading: str
    cell: Callable[[T], str]
    numeric: bool = True


def degrees(incline_deg: float) -> str:
    """Write an inclination."""
    return f"{incline_deg:g}".replace("-", MINUS)


def summary_incline(line: Incline) -> str:
    """Write the inclination of a mean; nothing where nothing is struck, so nothing is inclined."""
    return "" if acceleration_in(line.means) else degrees(line.incline_deg)


def run_incline(one: DropResult) -> str:
    """Write the inclination of a run; likewise."""
    return "" if one.run.impact is None else degrees(one.run.incline_deg)


def main_error(line: Incline) -> float | None:
    """Eₙ of the first of the quantities, which is what the scene is for."""
    return line.normalized_error(next(iter(line.means)))


def summary_columns() -> list[Column[Incline]]:
    """Columns of the summary; unlike chains have a line each.

    Eₙ is the normalized error; within ±1 measurement and prediction agree.
    """
    return [
        Column("incline (°)", summary_incline),
        Column("strikes", lambda line: line.impact_chain or "", numeric=False),
        Column("n", lambda line: str(line.n)),
        *(column for row in averaged() for column in _beside_model(row)),
        Column("Eₙ", lambda line: fixed(main_error(line), 2)),
    ]


def _beside_model(row: Measurand) -> tuple[Column[Incline], Column[Incline]]:
    def predicted(line: Incline) -> str:
        value = value_of(line.predicted.get(row.name))
        return "" if value is None else fixed(value * row.scale, row.decimals)

    return (
        Column(_heading(row), lambda line: _written(row, line.means)),
        Column(f"predicted {row.symbol} ({row.unit})", predicted),
    )


def _heading(row: Measurand) -> str:
    return f"{row.symbol} ± U ({row.unit})"


def _written(row: Measurand, quantities: Mapping[str, Measured]) -> str:
    return plus_minus(quantities.get(row.name), row.scale, row.decimals)


def run_columns() -> list[Column[DropResult]]:
    """Columns of the runs; raw Δz is as it happened, not corrected to simultaneous release."""
    return [
        Column("run", lambda one: str(one.run.number)),
        Column("attempt", lambda one: str(one.attempt)),
        Column("incline (°)", run_incline),
        Column("impact chain", lambda one: one.run.impact or "", numeric=False),
        *(_measured(row) for row in listed()),
        Column("edges", lambda one: " / ".join(map(str, one.audit.json().values()))),
        Column("verdict", lambda one: one.verdict, numeric=False),
    ]


def _measured(row: Measurand) -> Column[DropResult]:
    return Column(_heading(row), lambda one: _written(row, one.quantities))


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
    columns, rows = filled(columns, records)
    return text_table([[column.heading for column in columns], *rows], rule=True)


def summary_table(summary: Sequence[Incline]) -> str:
    """Write the summary as aligned text.

    Returns
    -------
    str
        Lines without an end of line at the last; one sentence where there is no summary.
    """
    if not summary:
        return "No accepted runs, so no summary."
    return "\n".join(aligned(summary_columns(), summary))
