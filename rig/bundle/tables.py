"""Tables of a bundle and their Frictionless description (``datapackage.json``)."""

from __future__ import annotations

import csv
import json
import math
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.analysis.summary import good_cases
from rig.bundle.digests import sha256
from rig.session.export import describe_column
from rig.text_table import csv_text

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rig.analysis.session import Analysis
    from rig.protocol.protocol import Protocol


def mean_tables(protocol: Protocol, analysis: Analysis) -> dict[str, str]:
    """Make ``means.csv`` and ``covariances.csv``.

    Means have their degrees of freedom beside value, u and U95. Covariances are those of means at
    two conditions, which share errors of the rig; of a joint fit only they are known.
    """
    struck = protocol.surface is not None
    means = [
        {**(line.condition.json() if struck else {}), "n": line.n, "quantity": name, **mean.json()}
        | {"degrees": mean.degrees if math.isfinite(mean.degrees) else "INF"}
        for line in analysis.summary
        for name, mean in line.means.items()
    ]
    shared = {}
    # Of a blind session there are cases, and no line.
    for line, drops in zip(analysis.summary, good_cases(protocol, analysis.runs), strict=False):
        for name in line.means:
            vectors = [drop.quantities[name].shared for drop in drops]
            if all(vector is not None for vector in vectors):
                shared[line.condition, name] = np.mean(np.array(vectors, float), axis=0)
    covariances = [
        {
            **one.json(),
            "quantity": quantity,
            **{f"{key}_2": value for key, value in other.json().items()},
            "quantity_2": other_quantity,
            "covariance": float(vector @ other_vector),
        }
        for ((one, quantity), vector), ((other, other_quantity), other_vector) in combinations(
            shared.items(), 2
        )
        if one != other  # in one drop, two quantities have more in common than what all drops share
    ]
    tables = {"means.csv": means, "covariances.csv": covariances}
    return {name: csv_text(rows[0], rows) for name, rows in tables.items() if rows}


def data_package(tables: Mapping[str, str]) -> str:
    """Describe CSV files: of each column its type, its unit and its meaning; of each its hash.

    Parameters
    ----------
    tables
        Texts by path.
    """
    resources = [_resource(path, text) for path, text in sorted(tables.items())]
    package = {"profile": "tabular-data-package", "name": "rig-tables", "resources": resources}
    return json.dumps(package, indent=1, ensure_ascii=False) + "\n"


def _resource(path: str, text: str) -> dict[str, Any]:
    table = path.rpartition("/")[2]
    header, *rows = csv.reader(text.splitlines()) if text.strip() else [[]]
    columns = {name: [row[n] for row in rows if row[n]] for n, name in enumerate(header)}
    fields = []
    for name, cells in columns.items():
        unit, meaning = describe_column(table, name)
        field = {"name": name, "type": _kind(cells), "unit": unit, "description": meaning}
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


def _kind(cells: list[str]) -> str:
    for kind, read in (("integer", int), ("number", float)):
        try:
            [read(cell) for cell in cells]
        except ValueError:
            continue
        return kind if cells else "string"
    return "string"
