"""Which table a record is of, told by its shape: a torn file need not have its schema any more."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeAlias

from rig.recover.pages import read_cells
from rig.session.hashes import check_chain
from rig.session.rows import RowError, check_row
from rig.session.schema import SCHEMA_VERSION, TABLES

if TYPE_CHECKING:
    from rig.recover.pages import PageCell, Pages

Row: TypeAlias = "tuple[Any, ...]"

_LENGTHS = {
    name: {len(table.names(version)) for version in range(table.since, SCHEMA_VERSION + 1)}
    for name, table in TABLES.items()
}
_TRIP_NS = 60 * 10**9  # no answer takes longer


@dataclass
class Rows:
    """The rows of a session by table, each by its key; `bad` counts unreadable ones.

    The key is the row's number, and of an edge the drop's number and its own.
    """

    tables: dict[str, dict[Any, Row]] = field(default_factory=lambda: {name: {} for name in TABLES})
    bad: int = 0

    def in_order(self, table: str) -> list[Row]:
        """List the rows of a table by key."""
        return [row for _, row in sorted(self.tables[table].items())]

    @property
    def meta(self) -> dict[str, str]:
        """What is known of the session."""
        return dict(self.tables["meta"].values())

    @property
    def protocol(self) -> tuple[str, str] | None:
        """Name and text of the protocol file."""
        return next(((source, text) for _, source, text in self.tables["protocol"].values()), None)

    @property
    def protocol_altered(self) -> bool:
        """Whether its text is there, and known not to be the one of the session's beginning."""
        if self.protocol is None:
            return False
        digest = hashlib.sha256(self.protocol[1].encode()).hexdigest()
        return self.meta.get("protocol_sha256", digest) != digest

    def any(self) -> bool:
        """Whether anything of a session was found."""
        return any(self.tables[name] for name in ("meta", "protocol", "bytes", "drop", "run_state"))

    def gaps(self, table: str) -> int:
        """Count the rows that are missing: a session numbers its rows from 1 without gaps."""
        numbers = self.tables[table]
        hashed = (last for _, covered, last, _ in self.in_order("hash") if covered == table)
        return int(max([0, *hashed, *numbers])) - len(numbers)

    def chain_faults(self) -> list[str]:
        """List what the chain of hashes says was altered; nothing where there is no chain."""
        rows = {
            name: [(key[0] if name == "edge" else key, row) for key, row in sorted(table.items())]
            for name, table in self.tables.items()
        }
        return check_chain(self.in_order("hash"), rows)


def find_rows(pages: Pages) -> Rows:
    """Read every record of every page.

    A page that SQLite has given back may still hold what another holds by now. Raw records are
    never altered, so both say the same, and the first counts. Results are left out: they are
    computed again.
    """
    rows = Rows()
    for number in sorted(pages.pages):
        for cell in read_cells(pages, number):
            if cell is None:
                rows.bad += 1
            else:
                _sort(rows, cell)
    return rows


def _sort(rows: Rows, cell: PageCell) -> None:
    """Put a record where it belongs by its shape; one that is no row of a session is left out."""
    for name in TABLES:
        row: Row = cell.values
        if row[:1] == (None,):  # SQLite leaves the number out of the record
            row = (cell.rowid, *row[1:])
        if (cell.rowid is None) == (name == "edge") and _fits(name, row):
            rows.tables[name].setdefault(row[:2] if name == "edge" else cell.rowid, row)
            return


def _fits(table: str, row: Row) -> bool:
    if len(row) not in _LENGTHS[table]:
        return False
    try:
        check_row(table, row)
    except RowError:
        return False
    # Breaks of the host have the same columns.
    return table != "ping" or 0 <= row[2] - row[1] <= _TRIP_NS
