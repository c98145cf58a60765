"""Results and raw records as CSV files for other programs."""

from __future__ import annotations

import csv
from collections.abc import Container, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from rig.bundle.archive import sha256
from rig.measurands import MEASURANDS
from rig.reasons import sentences
from rig.session.reading import Reader
from rig.session.schema import TABLES
from rig.text_rows import read_rows, read_text
from rig.text_table import csv_text
from rig.timers.edge_rows import edges_text

if TYPE_CHECKING:  # tables are written without numpy
    from rig.results.whole import SessionResults

_LISTS = ("budget", "causes", "gates")  # of objects, for which a cell has no room
_EDGES = "edges.csv"
_ROWS_OF = {"states.csv: ": "run_state", "pings.csv: ": "ping", "edges.csv: ": "edge"}
"""Whose raw records a file has, for the meaning of its columns."""
_ROWS = dict(read_rows(__file__, "columns.txt"))
"""The unit by the end of a column's name, which begins with ``_``, and what columns mean."""


def _meanings() -> dict[str, str]:
    """Return what columns mean, those of raw records and of measurands too."""
    meanings = {
        head + column.name: column.meaning
        for head, table in [*_ROWS_OF.items(), ("", "run_state")]
        for column in TABLES[table].columns
    } | _ROWS
    for row in MEASURANDS.values():
        meanings[row.name] = row.meaning
        meanings[row.key("sd")] = f"{row.symbol}: standard deviation between runs"
        meanings[row.key("se")] = f"{row.symbol}: standard error of the mean"
    return meanings


def csv_files(
    session: Reader, outcome: SessionResults, leave_out: Container[str] = ()
) -> dict[str, str]:
    """Make ``runs``, ``summary``, ``budget``, ``edges``, ``states`` and ``pings.csv``, a README.

    Columns are those the scene has; ``edges.csv`` is in the import format. Of one object there is
    ``gates.csv`` too.

    Parameters
    ----------
    session
        Open, for the raw records.
    outcome
        Results of the session.
    leave_out
        Names of files that are not wanted.

    Returns
    -------
    dict
        Texts by file name.
    """
    tables = {f"{name}.csv": rows for name, rows in result_tables(outcome.json()).items()}
    tables["states.csv"] = [
        {**entry._asdict(), "reasons": sentences(entry.reasons)} for entry in session.states()
    ]
    tables["pings.csv"] = [ping._asdict() for ping in session.pings()]
    files = {name: csv_text(rows) for name, rows in tables.items() if name not in leave_out}
    if _EDGES not in leave_out:
        drops = session.latest_drops()
        files[_EDGES] = edges_text(drops, lambda drop: outcome.clock.scale(drop).hz)
    return files | {"README.txt": _readme(session, files)}


def result_tables(analysis: Mapping[str, Any]) -> dict[str, list[dict[str, Any]]]:
    """Spread results over the rows of tables: ``runs``, ``summary``, ``budget``, ``gates``.

    Parameters
    ----------
    analysis
        What ``rig analyze --json`` prints. Without gates' passages there is no table of them.
    """
    latest, superseded = analysis["runs"], analysis.get("superseded", [])
    drops = [*latest, *superseded]
    # Where nothing is struck, nothing is inclined either.
    struck = any(drop["impact_chain"] is not None for drop in drops)
    no_columns = _LISTS if struck else (*_LISTS, "incline_deg", "impact_chain")

    def row(record: Mapping[str, Any]) -> dict[str, object]:
        return flatten({key: record[key] for key in record if key not in no_columns})

    def names(run: Mapping[str, Any]) -> dict[str, object]:
        return {key: run[key] for key in ("session", "run", "attempt") if key in run}

    runs = [row(drop) for drop in drops]
    if superseded:
        for place, run in enumerate(runs):
            run["superseded"] = int(place >= len(latest))
        runs.sort(key=lambda run: (run["run"], run["attempt"]))
    gates = [{**names(run), **flatten(gate)} for run in latest for gate in run.get("gates", ())]
    return {
        "runs": runs,
        "summary": [row(line) for line in analysis["summary"]],
        "budget": [
            names(run) | {"quantity": line["quantity"], "source": line["name"], "u": line["u"]}
            for run in drops
            for line in run["budget"]
        ],
        **({"gates": gates} if gates else {}),
    }


def column_unit(column: str) -> str:
    """Return the unit of a table's column, by the end of its name; empty where there is none."""
    name = column.removesuffix("_U95").removesuffix("_u")
    units = (unit for end, unit in _ROWS.items() if end[0] == "_" and name.endswith(end))
    return next(units, "")


def flatten(record: Mapping[str, Any], prefix: str = "") -> dict[str, object]:
    """Spread a JSON object over columns.

    A quantity ``x`` becomes ``x``, ``x_u`` and ``x_U95``; members of other objects get its name
    in front; lists of text are joined with semicolons, as are the codes of reasons; lists of other
    objects are left out.
    """
    columns: dict[str, object] = {}
    for key, value in record.items():
        name = prefix.removesuffix("_") if key == "value" else prefix + key
        if isinstance(value, dict):
            columns |= flatten(value, f"{name}_")
        elif isinstance(value, list):
            texts = [item.get("code") if isinstance(item, dict) else item for item in value]
            if None not in texts:
                columns[name] = "; ".join(map(str, texts))
        else:
            columns[name] = value
    return columns


def _readme(session: Reader, tables: Mapping[str, str]) -> str:
    lines = ["SIMULATED DATA: nothing fell.", ""] if session.simulated else []
    head = read_text(__file__, "readme.txt")
    lines += head.format(source=session.protocol_source, **session.meta).splitlines()
    for name, text in sorted(tables.items()):
        lines += ["", name]
        for column in next(csv.reader(text.splitlines())):
            unit, meaning = describe_column(name, column)
            words = f"[{unit}] {meaning}".removeprefix("[] ").rstrip()
            lines.append(f"  {column}: {words}" if words else f"  {column}")
    return "\n".join(lines) + "\n"


def describe_column(table: str, column: str) -> tuple[str, str]:
    """Return unit and meaning of a table's column; empty where its name says all."""
    if column.endswith(("_u", "_U95")):
        return "", ""
    meanings = _meanings()
    return column_unit(column), meanings.get(f"{table}: {column}", meanings.get(column, ""))


def data_package(tables: Mapping[str, str]) -> dict[str, Any]:
    """Describe CSV files for other programs (Frictionless): types, units, meanings, hashes.

    Parameters
    ----------
    tables
        Texts by file name.
    """
    resources = [_resource(name, text) for name, text in sorted(tables.items())]
    return {"profile": "tabular-data-package", "name": "rig-tables", "resources": resources}


def _resource(table: str, text: str) -> dict[str, Any]:
    fields = []
    for name, *cells in zip(*csv.reader(text.splitlines()), strict=True):
        unit, meaning = describe_column(table, name)
        kind = _type_of([*filter(None, cells)])
        field = {"name": name, "type": kind, "unit": unit, "description": meaning}
        fields.append({key: value for key, value in field.items() if value})
    return {
        "name": table.removesuffix(".csv"),
        "path": table,
        "profile": "tabular-data-resource",
        "format": "csv",
        "encoding": "utf-8",
        "bytes": len(text.encode()),
        "hash": f"sha256:{sha256(text.encode())}",
        "schema": {"fields": fields, "missingValues": [""]},
    }


def _type_of(cells: list[str]) -> str:
    for kind, read in {"integer": int, "number": float}.items() if cells else ():
        with suppress(ValueError):
            sum(map(read, cells))
            return kind
    return "string"
