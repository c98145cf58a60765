"""Hashes of a session file's rows, by table and by drop, so that an alteration has a name."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING

from rig.recover.pages import read_pages
from rig.recover.rows import find_rows

if TYPE_CHECKING:
    from collections.abc import Iterable

_TABLES = ("meta", "identity", "bytes", "ping", "reference", "host_break", "run_state")


def sha256(data: bytes) -> str:
    """Return the SHA-256 of some bytes, in hexadecimal."""
    return hashlib.sha256(data).hexdigest()


def hash_rows(data: bytes) -> dict[str, str]:
    """Hash the rows of a session file, by what they are.

    The file's pages are read one by one, so that damage to one of them leaves the others readable.

    Returns
    -------
    dict
        SHA-256 by the name of a table or of a drop.
    """
    rows = find_rows(read_pages(data))
    found = {f"table {name}": _hash(getattr(rows, name).items()) for name in _TABLES}
    found["table protocol"] = _hash([rows.protocol])
    for number, row in sorted(rows.drop.items()):
        edges = rows.edge.get(number, {})
        found[f"run {row[1]!r}, attempt {row[2]!r}"] = _hash([row, *edges.items()])
    stray = [(n, *rows.edge[n].items()) for n in sorted(rows.edge.keys() - rows.drop.keys())]
    return found | {"edges without a drop": _hash(stray)}


def _hash(rows: Iterable[object]) -> str:
    return sha256("\n".join(sorted(map(repr, rows))).encode())
