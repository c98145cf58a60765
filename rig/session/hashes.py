"""A chain of hashes over all rows of a session: what was altered, removed or reordered shows.

Each commit adds, in its own transaction, a row of table ``hash`` for every table that grew: the
SHA-256 of the hash before and of the new rows. There is no secret in it: whoever computes the chain
anew, or cuts off its end, hides an alteration. Only a signature of the whole file prevents that.
"""

from __future__ import annotations

import hashlib
import json
from collections import deque
from typing import TYPE_CHECKING, Any, NamedTuple

from rig.records import Job
from rig.session.schema import OLDER, TABLES, insert_statement

if TYPE_CHECKING:
    import sqlite3
    from collections.abc import Iterable, Mapping, Sequence

    KeyedRow = tuple[int, Sequence[Any]]

HASHED = [name for name in TABLES if name != "hash"]


class ChainEnd(NamedTuple):
    """Where a chain ends: the last row of each table that it covers, and the last hash."""

    last: Mapping[str, int]
    digest: bytes


def read_end(connection: sqlite3.Connection) -> ChainEnd:
    """Read where the chain of a session ends, which takes time with its length."""
    last = connection.execute("SELECT covered, MAX(last) FROM hash GROUP BY covered")
    tip = connection.execute("SELECT digest FROM hash ORDER BY id DESC LIMIT 1").fetchone()
    return ChainEnd(dict(last), tip[0] if tip else b"")


def extend_chain(connection: sqlite3.Connection, end: ChainEnd | None = None) -> ChainEnd:
    """Hash all rows that no hash covers, in the open transaction.

    Parameters
    ----------
    end
        Where the committed chain ends, if that is known.

    Returns
    -------
    ChainEnd
        Where it ends once the transaction is committed.
    """
    covered, digest = end or read_end(connection)
    last = {**covered}
    for table in HASHED:
        # A table that is kept as an index has no number of its own; edges go by their drop's.
        key, then = ('"drop"', ", idx") if table == "edge" else ("rowid", "")
        sql = f'SELECT {key}, * FROM "{table}" WHERE {key} > ? ORDER BY {key}{then}'  # noqa: S608
        rows = connection.execute(sql, (last.get(table, 0),)).fetchall()
        if rows:
            last[table] = rows[-1][0]
            digest = _digest(digest, table, (row[1:] for row in rows))
            connection.execute(insert_statement("hash"), (None, table, last[table], digest))
    return ChainEnd(last, digest)


def check_chain(
    links: Iterable[Sequence[Any]], rows: Mapping[str, Iterable[KeyedRow]]
) -> list[str]:
    """Compare a chain with the rows that it covers.

    Parameters
    ----------
    links
        The rows of table ``hash`` in order.
    rows
        Those of the other tables in order, each with its number; of an edge the drop's.

    Returns
    -------
    list of str
        What was altered, a line each; empty where everything agrees, or where there is no chain.
    """
    faults: list[str] = []
    ahead = {table: deque(rows[table]) for table in HASHED}
    drops = {number: str(Job(*row[1:3])) for number, row in ahead["drop"]}
    before, due, since = b"", 1, dict.fromkeys(HASHED, 0)
    for number, table, last, digest in links:
        if number != due:
            faults.append(f"table hash: rows {due} to {number - 1} are missing")
        batch = []
        while ahead.get(table) and ahead[table][0][0] <= last:
            batch.append(ahead[table].popleft()[1])
        if number == due and table != OLDER and digest != _digest(before, table, batch):
            span = range(since.get(table, 0) + 1, last + 1)
            known = drops if table in {"drop", "edge"} else {}
            own = [name for n, name in known.items() if n in span]
            names = "; ".join(own) or f"rows {span.start} to {last}"
            faults.append(f"table {table:.20}: not as recorded: {names}")
        since[table], before, due = last, digest, number + 1
    if due > 1:
        faults += [
            f"table {table}: rows after {since[table]} are in no hash"
            for table, left in ahead.items()
            if left
        ]
    return faults


def protocol_first(links: Sequence[Sequence[Any]]) -> bool | None:
    """Whether the protocol was hashed, once, before any run; `None` where there is no whole chain.

    Parameters
    ----------
    links
        As for `check_chain`, which must find no fault in them.
    """
    tables = [table for _, table, *_ in links]
    if not tables or OLDER in tables:
        return None
    runs = [tables.index(table) for table in ("drop", "run_state") if table in tables]
    return tables.count("protocol") == 1 and tables.index("protocol") < min(runs, default=2)


def _digest(before: bytes, table: str, rows: Iterable[Sequence[Any]]) -> bytes:
    # A later format may add columns, which are empty in the rows of this one. JSON writes the same
    # text with every version of Python.
    text = json.dumps([table, *map(_strip, rows)], default=bytes.hex)
    return hashlib.sha256(before + text.encode()).digest()


def _strip(row: Sequence[Any]) -> list[Any]:
    values = list(row)
    while values and values[-1] is None:
        values.pop()
    return values
