"""Which table a record is of, told by its shape: a torn file need not have its schema any more."""

from __future__ import annotations

import hashlib
from contextlib import suppress
from dataclasses import dataclass, field

from rig.recover.pages import Pages, read_cells
from rig.session.hashes import check_chain
from rig.session.rows import RowError, check_row
from rig.session.schema import TABLES, Row

_TRIP_NS = 60 * 10**9  # no answer takes longer


@dataclass
class Rows:
    """The rows of a session by table, each by its key; `bad` counts unreadable ones.

    The key is the row's number, and of an edge the drop's number and its own.
    """

    tables: dict[str, dict[Row, Row]] = field(default_factory=lambda: {name: {} for name in TABLES})
    bad: int = 0

    def add(self, rowid: int | None, row: Row) -> None:
        """Put a record where it belongs by its shape; what is no row of a session is left out."""
        if row[:1] == (None,):  # SQLite leaves the number out of the record
            row = (rowid, *row[1:])
        for name, table in TABLES.items():
            if (rowid is None) == (table.key > 1) and len(row) in table.lengths:
                with suppress(RowError):
                    check_row(name, row)
                    # Breaks of the host have the same columns as clock samples.
                    if name != "ping" or 0 <= row[2] - row[1] <= _TRIP_NS:
                        key = row[: table.key] if rowid is None else (rowid,)
                        self.tables[name].setdefault(key, row)
                        return

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

    def gaps(self, table: str) -> int:
        """Count the rows that are missing: a session numbers its rows from 1 without gaps."""
        numbers = self.tables[table]
        hashed = (last for _, covered, last, _ in self.tables["hash"].values() if covered == table)
        return int(max([0, *hashed, *(number for (number,) in numbers)])) - len(numbers)

    def chain_faults(self) -> list[str]:
        """List what the chain of hashes says was altered; nothing where there is no chain."""
        return check_chain(self.tables)


def find_rows(pages: Pages) -> Rows:
    """Read every record of every page.

    A page that SQLite has given back may still hold what another holds by now. Raw records are
    never altered, so both say the same, and the first counts. Results are left out: they are
    computed again.
    """
    cells = [cell for number in pages.pages for cell in read_cells(pages, number)]
    rows = Rows(bad=cells.count(None))
    for cell in filter(None, cells):
        rows.add(*cell)
    return rows
