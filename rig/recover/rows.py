"""Assignment of records to tables by their shape, as a damaged file may lack its schema."""

import hashlib
from contextlib import suppress
from dataclasses import dataclass, field

from rig.recover.pages import Pages, read_cells
from rig.session.rows import RowError, check_rows
from rig.session.schema import TABLES, Row

_TRIP_NS = 60 * 10**9  # longest round trip of an answer


@dataclass
class Rows:
    """The rows of a session by table and key; `bad` counts unreadable ones.

    The key is the row's number; for an edge, the drop's number and its own.
    """

    tables: dict[str, dict[Row, Row]] = field(default_factory=lambda: {name: {} for name in TABLES})
    bad: int = 0

    def add(self, rowid: int | None, row: Row) -> None:
        """Add a record to the table of its shape; records of no table are left out."""
        if row[:1] == (None,):  # SQLite omits the number from the record
            row = (rowid, *row[1:])
        for name, table in TABLES.items():
            if (rowid is None) == (table.key > 1) and len(row) in table.lengths:
                with suppress(RowError):
                    check_rows(name, [row])
                    # Breaks of the host have the same columns as clock samples.
                    if name != "ping" or 0 <= row[2] - row[1] <= _TRIP_NS:
                        key = row[: table.key] if rowid is None else (rowid,)
                        self.tables[name].setdefault(key, row)
                        return

    def in_order(self, table: str) -> list[Row]:
        """Return the rows of a table by key."""
        return [row for _, row in sorted(self.tables[table].items())]

    @property
    def meta(self) -> dict[str, str]:
        """Metadata of the session."""
        return dict(self.tables["meta"].values())

    @property
    def protocol(self) -> tuple[str, str] | None:
        """Name and text of the protocol file."""
        return next(((source, text) for _, source, text in self.tables["protocol"].values()), None)

    @property
    def protocol_altered(self) -> bool:
        """Whether the protocol's text exists but does not match its stored hash."""
        if self.protocol is None:
            return False
        digest = hashlib.sha256(self.protocol[1].encode()).hexdigest()
        return self.meta.get("protocol_sha256", digest) != digest

    def gaps(self, table: str) -> int:
        """Return the number of missing rows: a session numbers rows from 1 without gaps."""
        numbers = self.tables[table]
        hashed = (last for _, covered, last, _ in self.tables["hash"].values() if covered == table)
        return int(max([0, *hashed, *(number for (number,) in numbers)])) - len(numbers)


def find_rows(pages: Pages) -> Rows:
    """Return the rows of all records of all pages.

    A free page may still contain records that another page has now. Raw records are never altered,
    so both are equal, and the first counts. Results are left out, as they can be computed again.
    """
    cells = [cell for number in pages.pages for cell in read_cells(pages, number)]
    rows = Rows(bad=cells.count(None))
    for cell in filter(None, cells):
        rows.add(*cell)
    return rows
