"""Result tables: their columns, for the terminal and the page alike, and as text."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, NamedTuple, TypeVar

from rig.analysis.result import COUNTS, Measured
from rig.measurands import acceleration_in, averaged, listed
from rig.report.numbers import degrees, fixed, plus_minus
from rig.text_table import text_table

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from rig.analysis.result import DropResult
    from rig.analysis.summary import Incline
    from rig.measurands import Measurand

T = TypeVar("T")

AGREES, DISAGREES = "agrees", "disagrees"
"""What stands beside Eₙ."""


@dataclass(frozen=True, slots=True)
class Column(Generic[T]):
    """A heading with its unit, and how a record fills the cell."""

    heading: str
    cell: Callable[[T], str]
    numeric: bool = True


class Mean(NamedTuple):
    """A measurand of a line of the summary that has its mean."""

    line: Incline
    row: Measurand


def summary_incline(line: Incline) -> str:
    """Write the inclination of a mean; nothing where nothing is struck, so nothing is inclined."""
    return "" if acceleration_in(line.means) else degrees(line.incline_deg)


def run_incline(one: DropResult) -> str:
    """Write the inclination of a run; likewise."""
    return "" if one.run.impact is None else degrees(one.run.incline_deg)


def main_error(line: Incline) -> float | None:
    """Eₙ of the first of the quantities, which is what the scene is for."""
    return line.normalized_error(next(iter(line.means)))


def summary_columns(row: Measurand) -> list[Column[Incline]]:
    """Columns of the means of a measurand beside the model; unlike chains have a line each.

    Eₙ is the normalized error; within ±1 measurement and prediction agree.
    """
    return [
        *mean_columns(lambda line: line),
        Column(_heading(row), lambda line: _written(row, line.means)),
        Column(f"predicted ± U ({row.unit})", lambda line: _predicted(row, line)),
        Column("Eₙ", lambda line: fixed(line.normalized_error(row.name), 2)),
        Column("model", lambda line: verdict_on(line.normalized_error(row.name)), numeric=False),
    ]


def value_columns(rows: Sequence[Measurand]) -> list[Column[Incline]]:
    """Columns of the means of several measurands, without the model."""
    return [*mean_columns(lambda line: line), *map(_mean_column, rows)]


def _mean_column(row: Measurand) -> Column[Incline]:
    return Column(_heading(row), lambda line: _written(row, line.means))


def mean_columns(of: Callable[[T], Incline]) -> tuple[Column[T], ...]:
    """Columns that say of which runs a mean is."""
    return (
        Column("incline (°)", lambda record: summary_incline(of(record))),
        Column("strikes", lambda record: of(record).impact_chain or "", numeric=False),
        Column("n", lambda record: str(of(record).n)),
    )


def fine(row: Measurand, value: float | None) -> str:
    """Write a value of a measurand, SI, in its smaller unit; nothing for `None`."""
    return "" if value is None else fixed(value * row.fine_scale, row.fine_decimals)


def verdict_on(error: float | None) -> str:
    """Say what a normalized error means; nothing where nothing was compared."""
    if error is None:
        return ""
    return AGREES if abs(error) <= 1.0 else DISAGREES


def _predicted(row: Measurand, line: Incline) -> str:
    """Write what the model says; one that knows its numbers exactly has no ±."""
    model = line.predicted.get(row.name)
    if model is None:
        return ""
    if not model.u:
        return fixed(model.value * row.scale, row.decimals)
    return plus_minus(Measured(model.value, model.u), row.scale)


def _heading(row: Measurand) -> str:
    return f"{row.symbol} ± U ({row.unit})"


def _written(row: Measurand, quantities: Mapping[str, Measured]) -> str:
    return plus_minus(quantities.get(row.name), row.scale, row.decimals)


def run_columns() -> list[Column[DropResult]]:
    """Columns of the runs; raw Δz is as it happened, not corrected to simultaneous release."""
    return [
        Column("run", lambda one: str(one.run.number)),
        Column("attempt", lambda one: str(one.attempt)),
        Column("verdict", lambda one: one.verdict, numeric=False),
        Column("incline (°)", run_incline),
        Column("impact chain", lambda one: one.run.impact or "", numeric=False),
        *(_measured(row) for row in listed()),
        Column("edges", lambda one: " / ".join(str(getattr(one.audit, name)) for name in COUNTS)),
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
    words = {place for place, column in enumerate(columns) if not column.numeric}
    return text_table([[column.heading for column in columns], *rows], left=words, rule=True)


def summary_table(summary: Sequence[Incline]) -> str:
    """Write the summary as aligned text, a block for each measurand, none wider than 80.

    Returns
    -------
    str
        Lines without an end of line at the last; one sentence where there is no summary.
    """
    if not summary:
        return "No accepted runs, so no summary."
    blocks = []
    for row in averaged():
        lines = [line for line in summary if row.name in line.means]
        if lines:
            blocks.append("\n".join(aligned(summary_columns(row), lines)))
    return "\n\n".join(blocks)
