"""What the bars on a mean stand for, which is the reader's choice."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

from rig.measurands import MEASURANDS
from rig.report.numbers import expanded, nested, value_of

if TYPE_CHECKING:
    from collections.abc import Mapping

Bars = Literal["U95", "u", "SE", "SD", "half-SD"]

LABELS: dict[Bars, str] = {
    "U95": "U (95 %)",
    "u": "u",
    "SE": "SE",
    "SD": "SD of one run",
    "half-SD": "SD/2 of one run",
}


def bar(line: Mapping[str, Any], name: str, bars: Bars) -> float | None:
    """Half the length of a bar; `None` where there is none, as of the scatter of a single run.

    Parameters
    ----------
    line
        Of the summary of ``rig analyze --json``.
    name
        Of the quantity there, ``separation_m``.
    bars
        Expanded or standard uncertainty of the mean; standard error by scatter alone; standard
        deviation of one run, or half of it, as in Pantaleone's figures.
    """
    row = MEASURANDS[name]
    if bars == "U95":
        return expanded(line.get(name))
    if bars == "u":
        return value_of(nested(line, name, "u"))
    if bars == "SE":
        return value_of(line.get(row.key("se")))
    found = value_of(line.get(row.key("sd")))
    return found if found is None or bars == "SD" else found / 2.0
