"""Hash chain over all rows of a session, which detects altered, removed or reordered rows.

Each commit adds, in its own transaction, a row of table ``hash`` for every table that grew: the
SHA-256 of the previous hash and the new rows. The chain has no secret: an alteration can be hidden
by a new chain, or by a cut at its end. Only a signature of the whole file prevents that.
"""

import hashlib
import json
import sqlite3
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from rig.records import Job
from rig.session.schema import OLDER, TABLES, Row

HASHED = [name for name in TABLES if name != "hash"]


class ChainEnd(NamedTuple):
    """End of a chain: the last row of each table that it covers, and the last hash."""

    last: Mapping[str, int]
    digest: bytes


def extend_chain(connection: sqlite3.Connection, end: ChainEnd | None = None) -> ChainEnd:
    """Add hashes for all new rows, in the open transaction.

    Parameters
    ----------
    end
        End of the committed chain, if known; reading it takes time in proportion to its length.

    Returns
    -------
    ChainEnd
        End of the chain once the transaction is committed.
    """
    if end is None:
        covered = connection.execute("SELECT covered, MAX(last) FROM hash GROUP BY covered")
        tip = connection.execute("SELECT digest FROM hash ORDER BY id DESC LIMIT 1").fetchone()
        end = ChainEnd(dict(covered), tip[0] if tip else b"")
    last, digest = {**end.last}, end.digest
    for table in HASHED:
        # A row without a number uses that of another: an edge uses its drop's.
        order = TABLES[table].order
        number = order.partition(",")[0]
        sql = f'SELECT {number}, * FROM "{table}" WHERE {number} > ? ORDER BY {order}'  # noqa: S608
        rows = connection.execute(sql, (last.get(table, 0),)).fetchall()
        if rows:
            last[table] = rows[-1][0]
            digest = _digest(digest, table, (row[1:] for row in rows))
            connection.execute(TABLES["hash"].insert, (None, table, last[table], digest))
    return ChainEnd(last, digest)


def check_chain(tables: Mapping[str, Mapping[Row, Row]]) -> list[str]:
    """Compare the chain of a session with the rows that it covers.

    Parameters
    ----------
    tables
        Rows of each table by their keys, which begin with the number used by the chain.

    Returns
    -------
    list of str
        A line for each alteration; empty if all rows agree, or without a chain.
    """
    faults: list[str] = []
    ahead = {table: deque(sorted(tables[table].items())) for table in HASHED}
    jobs = {number: str(Job(*row[1:3])) for (number,), row in ahead["drop"]}
    before, due, since = b"", 1, dict.fromkeys(HASHED, 0)
    for _, (number, table, last, digest) in sorted(tables["hash"].items()):
        if number != due:
            faults.append(f"table hash: rows {due} to {number - 1} are missing")
        rows, batch = ahead.get(table), []
        while rows and rows[0][0] < (last + 1,):
            batch.append(rows.popleft()[1])
        if number == due and table != OLDER and digest != _digest(before, table, batch):
            span = range(since.get(table, 0) + 1, last + 1)
            own = [jobs[n] for n in jobs if n in span and table in {"drop", "edge"}]
            names = "; ".join(own) or f"rows {span.start} to {last}"
            faults.append(f"table {table:.20}: not as recorded: {names}")
        since[table], before, due = last, digest, number + 1
    if due > 1:
        left = [table for table in HASHED if ahead[table]]
        faults += [f"table {table}: rows after {since[table]} are in no hash" for table in left]
    return faults


def protocol_first(links: Sequence[Sequence[Any]]) -> bool | None:
    """Whether the protocol was hashed once, before any run; `None` without a complete chain.

    Parameters
    ----------
    links
        The rows of table ``hash`` in order, without faults by `check_chain`.
    """
    tables = [table for _, table, *_ in links]
    if not tables or OLDER in tables:
        return None
    runs = [tables.index(table) for table in ("drop", "run_state") if table in tables]
    return tables.count("protocol") == 1 and tables.index("protocol") < min(runs, default=2)


def _digest(before: bytes, table: str, rows: Iterable[Sequence[Any]]) -> bytes:
    # Columns of later formats are empty in rows of this format. JSON text is the same with every
    # version of Python.
    text = json.dumps([table, *map(_strip, rows)], default=bytes.hex)
    return hashlib.sha256(before + text.encode()).digest()


def _strip(row: Sequence[Any]) -> list[Any]:
    while row and row[-1] is None:
        row = row[:-1]
    return [*row]
