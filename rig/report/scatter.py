"""How the runs of each incline scatter: SD, SE and U side by side, and the paper's bars."""

from __future__ import annotations

from operator import itemgetter
from typing import TYPE_CHECKING, Any

from rig.measurands import averaged
from rig.report.bars import LABELS, bar
from rig.report.columns import Column, incline
from rig.report.numbers import fixed, value_of
from rig.report.parts import Part

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    Record = Mapping[str, Any]

_HEADINGS = {"incline": "incline (°)", "strikes": "strikes", "n": "n", "quantity": ""}
_HEADINGS |= {"mean": "mean", "SD": "SD", "SE": "SE", "u": "u", "U95": "U95", "half-SD": "SD/2"}
_COLUMNS = tuple(
    Column(heading, itemgetter(key), numeric=key not in {"quantity", "strikes"})
    for key, heading in _HEADINGS.items()
)


def scatter_part(found: Mapping[str, Any]) -> Part:
    """Make the table.

    Parameters
    ----------
    found
        What ``rig analyze --json`` prints.
    """
    return Part(
        "Scatter of the runs",
        [
            "SD is the standard deviation of one run, SE that of the mean by scatter alone; u is "
            "the standard uncertainty of the mean with what all runs have in common, U95 the "
            "expanded one. SD/2 are the bars of Pantaleone's figures."
        ],
        _COLUMNS,
        [*_records(found.get("summary") or ())],
    )


def _records(summary: Any) -> Iterator[Record]:
    for line in summary:
        for row in averaged():
            if row.name not in line:
                continue
            values: dict[str, float | None] = {"mean": value_of(line[row.name])}
            values |= {kind: bar(line, row.name, kind) for kind in LABELS}
            yield {
                "incline": incline(line),
                "strikes": str(line.get("impact_chain", "")),
                "n": fixed(line["n"], 0),
                "quantity": f"{row.symbol} ({row.fine})",
                **{
                    key: "" if value is None else fixed(value * row.fine_scale, row.fine_decimals)
                    for key, value in values.items()
                },
            }
