"""Means with their degrees of freedom, and the covariance of means, as tables of a bundle."""

import math
from itertools import combinations

from rig.analysis.session import Analysis
from rig.protocol.protocol import Protocol
from rig.text_table import csv_text


def mean_tables(protocol: Protocol, analysis: Analysis) -> dict[str, str]:
    """Make ``means.csv`` and ``covariances.csv``.

    Covariances are those of means at two conditions, which share errors of the rig; of a joint fit
    only they are known. In one drop, two quantities have more in common than what all drops share,
    so there is no covariance of two means at one condition.
    """
    means: list[dict[str, object]] = []
    shared = {}
    for line in analysis.summary:
        at = line.condition.json()
        if protocol.surface is None:
            del at["incline_deg"]
        for name, mean in line.means.items():
            degrees = mean.degrees if math.isfinite(mean.degrees) else "INF"
            means.append({**at, "n": line.n, "quantity": name, **mean.json(), "degrees": degrees})
            if mean.shared is not None:
                shared[line.condition, name] = mean.shared
    pairs = combinations(shared.items(), 2)
    covariances: list[dict[str, object]] = [
        {
            **first.json(),
            "quantity": quantity,
            **{f"{key}_2": value for key, value in second.json().items()},
            "quantity_2": other_quantity,
            "covariance": float(vector @ other_vector),
        }
        for ((first, quantity), vector), ((second, other_quantity), other_vector) in pairs
        if first != second
    ]
    tables = {"means.csv": means, "covariances.csv": covariances}
    return {name: csv_text(rows) for name, rows in tables.items() if rows}
