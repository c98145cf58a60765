"""Rows of a session: checks by column, and conversion between a drop and its rows."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import fields
from typing import Any

from rig.printable import encodable
from rig.records import Certificate, Drop, Edge
from rig.session.schema import TABLES, Record, read_reasons, write_reasons

_DROP = TABLES["drop"].names()
_ACCOUNT = [field.name for field in fields(Certificate)]
_CERTIFIED = [field.name for field in fields(Certificate) if field.default is not None]
"""Columns of every certificate, in all formats of the file."""
_PLAIN = [field.name for field in fields(Drop) if field.name in {*_DROP} - {"faults"}]
"""Columns that a drop has unchanged."""


class RowError(ValueError):
    """A row with an invalid value."""


def check_row(table: str, row: Sequence[object]) -> None:
    """Check every value of a row.

    Parameters
    ----------
    table
        A name in `TABLES`.
    row
        Its columns, in order; a row of an older format has fewer.

    Raises
    ------
    RowError
        A value is invalid; names value, place and accepted values.
    """
    for column, value in zip(TABLES[table].columns, row, strict=False):
        if not column.accepts(value):
            at = row[0] if TABLES[table].key == 1 else row[: TABLES[table].key]
            fault = f"{column.name} {value!r:.40} is not {column.accepted}"
            raise RowError(f"table {table}, row {at!r:.40}: {fault}")
    if table == "drop":
        values = named_values(row)
        if len({values[name] is None for name in _CERTIFIED if name in values}) > 1:
            raise RowError(f"table drop, row {row[0]}: half of its certificate is missing")


def named_values(row: Sequence[Any]) -> dict[str, Any]:
    """Return the values of a row of ``drop`` by column."""
    return dict(zip(_DROP, row, strict=False))


def drop_of(row: Sequence[Any], edges: Iterable[Sequence[Any]]) -> Drop:
    """Return the drop of checked rows of the drop and its edges; damaged if edges are missing."""
    values, edges = named_values(row), [*edges]
    torn = any(edge[1] != number for number, edge in enumerate(edges))
    # Certificates of older formats lack some columns.
    account: dict[str, Any] = {name: values.get(name) for name in _ACCOUNT}
    return Drop(
        **{name: values[name] for name in _PLAIN},
        edges=tuple(Edge(tick, channel, bool(blocked)) for _, _, tick, channel, blocked in edges),
        certificate=None if values["events"] is None else Certificate(**account),
        faults=read_reasons(values["faults"]),
        damage="edges of it are missing" if torn else "",
    )


def rows_of(drop: Drop, number: int, host_ns: int | None, provenance: str) -> Record:
    """Return the rows of a drop by table; without a certificate its columns are empty."""
    values = {
        "id": number,
        "faults": write_reasons(drop.faults),
        "host_ns": host_ns,
        "provenance": encodable(provenance),
        **{name: getattr(drop.certificate, name, None) for name in _ACCOUNT},
    }
    row = [values[name] if name in values else getattr(drop, name) for name in _DROP]
    edges = [[number, index, *map(int, edge)] for index, edge in enumerate(drop.edges)]
    return {"drop": [row], "edge": edges}
