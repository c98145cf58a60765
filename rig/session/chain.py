"""A chain of hashes over all rows of a session: what was altered, removed or reordered shows.

At each commit, and in its transaction, every table that grew gets one link: the SHA-256 of the link
before and of the new rows. The chain has no secret. Whoever computes it anew can hide an
alteration, which only a signed bundle of the session would show.
"""

from __future__ import annotations

import hashlib
import json
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    import sqlite3

_KEYS = {
    "meta": "rowid",
    "protocol": "id",
    "identity": "id",
    "bytes": "id",
    "ping": "id",
    "reference": "id",
    "host_break": "id",
    "drop": "id",
    "edge": '"drop"',
    "run_state": "id",
    "attachment": "id",
}
"""The column by which the rows of a table are in order of recording."""

OLDER = "older"
"""In place of a table's name, by `schema.UPGRADES`: rows were there before the chain began."""


class ChainEnd(NamedTuple):
    """Where a chain ends: the last key of each table, and the last link."""

    last: dict[str, int]
    digest: bytes = b""


class ChainCheck(NamedTuple):
    """A chain beside its rows.

    Attributes
    ----------
    links
        The name of the table of each, in order.
    faults
        What does not agree.
    """

    links: list[str]
    faults: list[str]

    def __str__(self) -> str:
        if not self.links:
            return "chain: none; the session was recorded by an older program"
        since = ", begun when this program continued the session" if OLDER in self.links else ""
        return f"chain: {len(self.links)} links, {'not ' if self.faults else ''}whole{since}"

    @property
    def protocol_first(self) -> bool | None:
        """Whether the protocol was fixed before the first run; `None` where that is unknown."""
        if not self.links or OLDER in self.links:
            return None
        rows = self.links[: self.links.index("run_state")] if "run_state" in self.links else ()
        broken = any(fault.startswith(("chain", "table protocol")) for fault in self.faults)
        return not broken and (not rows or ("protocol" in rows and "drop" not in rows))


def read_end(connection: sqlite3.Connection) -> ChainEnd:
    """Read where the chain of a session ends."""
    last = dict(connection.execute("SELECT name, MAX(last) FROM chain GROUP BY name"))
    tip = connection.execute("SELECT digest FROM chain ORDER BY id DESC LIMIT 1").fetchone()
    return ChainEnd(last, *(tip or ()))


def extend(connection: sqlite3.Connection, end: ChainEnd) -> ChainEnd:
    """Add links for all rows that have none, in the open transaction.

    Parameters
    ----------
    end
        Where the committed chain ends.

    Returns
    -------
    ChainEnd
        Where it ends once the transaction is committed.
    """
    last, digest = dict(end.last), end.digest
    for table in _KEYS:
        rows = _rows(connection, table, last.get(table, 0))
        if rows:
            last[table], digest = rows[-1][0], _digest(digest, table, rows)
            link = (table, last[table], digest)
            connection.execute("INSERT INTO chain (name, last, digest) VALUES (?, ?, ?)", link)
    return ChainEnd(last, digest)


def check_chain(connection: sqlite3.Connection) -> ChainCheck:
    """Compare every link of a session with its rows."""
    named = "SELECT 1 FROM sqlite_master WHERE name = 'chain'"
    if connection.execute(named).fetchone() is None:
        return ChainCheck([], [])
    faults: list[str] = []
    last: dict[str, int] = {}
    before, links = b"", connection.execute("SELECT * FROM chain ORDER BY id").fetchall()
    check = ChainCheck([link[1] for link in links], faults)
    for number, (link, table, until, digest) in enumerate(links, 1):
        if link != number or table not in {OLDER, *_KEYS}:
            faults.append(f"chain: link {number} is missing, or of no table")
            return check
        since = last.get(table, 0)
        if table != OLDER and digest != _digest(
            before, table, _rows(connection, table, since, until)
        ):
            faults.append(f"table {table}, rows {since + 1} to {until}: not as recorded")
        last[table], before = until, digest
    faults += [
        f"table {table}: rows after {last.get(table, 0)} are in no link"
        for table in _KEYS
        if _rows(connection, table, last.get(table, 0))
    ]
    return check


def _rows(
    connection: sqlite3.Connection, table: str, since: int, until: int = (1 << 63) - 1
) -> list[tuple[Any, ...]]:
    key = _KEYS[table]
    order = f"{key}, idx" if table == "edge" else key
    return connection.execute(
        f'SELECT {key}, * FROM "{table}" WHERE {key} > ? AND {key} <= ? ORDER BY {order}',  # noqa: S608
        (since, until),
    ).fetchall()


def _digest(before: bytes, table: str, rows: list[tuple[Any, ...]]) -> bytes:
    # JSON writes the same text with every version of Python.
    text = json.dumps([table, rows], default=bytes.hex)
    return hashlib.sha256(before + text.encode()).digest()
