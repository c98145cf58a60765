"""Which table a record is of, told by its shape: a torn file need not have its schema any more."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias, cast

from rig.recover.pages import read_cells
from rig.session.rows import COLUMNS, RowError, check_row

if TYPE_CHECKING:
    from rig.recover.pages import PageCell, Pages, Value

Row: TypeAlias = "tuple[Value, ...]"

_TABLES = ("bytes", "identity", "ping", "host_break", "reference", "run_state", "drop")
_LENGTHS = {"drop": {14, 15, 20}}  # of each format
_TRIP_NS = 60 * 10**9  # no answer takes longer


@dataclass
class Rows:
    """The rows of a session, by table; those with a number by it. `bad` counts unreadable ones."""

    meta: dict[str, str] = field(default_factory=dict)
    protocol: tuple[str, str] | None = None
    identity: dict[int, Row] = field(default_factory=dict)
    bytes: dict[int, Row] = field(default_factory=dict)
    ping: dict[int, Row] = field(default_factory=dict)
    reference: dict[int, Row] = field(default_factory=dict)
    host_break: dict[int, Row] = field(default_factory=dict)
    drop: dict[int, Row] = field(default_factory=dict)
    edge: dict[int, dict[int, Row]] = field(default_factory=dict)
    run_state: dict[int, Row] = field(default_factory=dict)
    bad: int = 0

    def any(self) -> bool:
        """Whether anything of a session was found."""
        return bool(self.meta or self.protocol or self.bytes or self.drop or self.run_state)


def find_rows(pages: Pages) -> Rows:
    """Read every record of every page.

    A page that SQLite has given back may still hold what another holds by now. Raw records are
    never altered, so both say the same, and the first counts. Results are left out: they are
    computed again.
    """
    rows = Rows()
    for number in sorted(pages.pages):
        cells, bad = read_cells(pages, number)
        rows.bad += bad
        for cell in cells:
            _sort(rows, cell)
    return rows


def gaps(numbers: dict[int, Row]) -> int:
    """Count the rows that are missing: a session numbers its rows from 1 without gaps."""
    return max(numbers) - len(numbers) if numbers else 0


def _sort(rows: Rows, cell: PageCell) -> None:
    """Put a record where it belongs by its shape; one that is no row of a session is left out."""
    rowid, values = cell
    match rowid, values:
        case None, (int(drop), int(index), *_) if _fits("edge", values):
            rows.edge.setdefault(drop, {}).setdefault(index, values)
        case None, _:
            return
        case int(), (str(key), str(value)):
            rows.meta.setdefault(key, value)
        case int(), (None, str(source), str(text)):
            rows.protocol = rows.protocol or (source, text)
        case int(), (None, *rest):
            row = (rowid, *rest)  # SQLite leaves the number out of the record
            table = next((name for name in _TABLES if _fits(name, row)), None)
            if table is not None:
                getattr(rows, table).setdefault(rowid, row)


def _fits(table: str, row: Row) -> bool:
    if len(row) not in _LENGTHS.get(table, {len(COLUMNS[table])}):
        return False
    try:
        check_row(table, row)
    except RowError:
        return False
    # Breaks of the host have the same columns.
    return table != "ping" or 0 <= cast("int", row[2]) - cast("int", row[1]) <= _TRIP_NS
