"""Rows of a session: checks by column, and conversion between a drop and its rows."""

from collections.abc import Iterable, Sequence
from dataclasses import fields
from typing import Any

import msgspec

from rig.printable import encodable
from rig.records import Certificate, Drop, Edge
from rig.session.schema import TABLES, Record, Row, read_reasons, write_reasons

_DROP = TABLES["drop"].names()
_ACCOUNT = [field.name for field in fields(Certificate)]
_CERTIFIED = [field.name for field in fields(Certificate) if field.default is not None]
"""Columns of every certificate, in all formats of the file."""
_PLAIN = [field.name for field in fields(Drop) if field.name in {*_DROP} - {"faults"}]
"""Columns that a drop has unchanged."""


class RowError(ValueError):
    """A row with an invalid value."""


def check_rows(table: str, rows: Sequence[Row]) -> None:
    """Check every value of some rows.

    Parameters
    ----------
    table
        A name in `TABLES`.
    rows
        Of each its columns, in order; rows of an older format have fewer, all of them.

    Raises
    ------
    RowError
        A value is invalid; names value, place and accepted values.
    """
    for column, values in zip(TABLES[table].columns, zip(*rows, strict=True), strict=False):
        if not column.kind.accepts(values):
            for row in rows[:-1]:  # the first invalid row is named
                check_rows(table, [row])
            at = rows[-1][0] if TABLES[table].key == 1 else rows[-1][: TABLES[table].key]
            fault = f"{column.name} {values[-1]!r:.40} is not {column.kind.accepted}"
            raise RowError(f"table {table}, row {at!r:.40}: {fault}")
    for drop in map(named_values, rows if table == "drop" else ()):
        if len({drop[name] is None for name in _CERTIFIED if name in drop}) > 1:
            raise RowError(f"table drop, row {drop['id']}: half of its certificate is missing")


def named_values(row: Sequence[Any]) -> dict[str, Any]:
    """Return the values of a row of ``drop`` by column."""
    return dict(zip(_DROP, row, strict=False))


def drop_of(row: Sequence[Any], edges: Iterable[Sequence[Any]]) -> Drop:
    """Return the drop of checked rows of the drop and its edges; damaged if edges are missing."""
    values, edges = named_values(row), [*edges]
    torn = [edge[1] for edge in edges] != [*range(len(edges))]
    changes = [(tick, channel, blocked == 1) for _, _, tick, channel, blocked in edges]
    # Certificates of older formats lack some columns.
    account: dict[str, Any] = {name: values.get(name) for name in _ACCOUNT}
    return Drop(
        **{name: values[name] for name in _PLAIN},
        edges=msgspec.convert(changes, tuple[Edge, ...]),
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
