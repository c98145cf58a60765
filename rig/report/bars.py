"""What the bars on a mean stand for, which is the reader's choice."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from rig.analysis.summary import Incline

Bars = Literal["U95", "u", "SE", "SD", "half-SD"]

LABELS: dict[Bars, str] = {
    "U95": "U (95 %)",
    "u": "u",
    "SE": "SE",
    "SD": "SD of one run",
    "half-SD": "SD/2 of one run",
}


def bar(line: Incline, name: str, bars: Bars) -> float | None:
    """Half the length of a bar; `None` where there is none, as of the scatter of a single run.

    Parameters
    ----------
    line
        Of the summary.
    name
        Of a quantity that has a mean there, as in JSON.
    bars
        Expanded or standard uncertainty of the mean; standard error by scatter alone; standard
        deviation of one run, or half of it, as in Pantaleone's figures.
    """
    if bars == "U95":
        return line.means[name].expanded
    if bars == "u":
        return line.means[name].u
    if name not in line.deviations:
        return None
    return line.deviations[name] / {"SE": math.sqrt(line.n), "SD": 1.0, "half-SD": 2.0}[bars]
