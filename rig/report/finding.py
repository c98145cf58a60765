"""What a session says in plain sentences: the card of a report, the last words of a run."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from rig.measurands import ACCELERATION, GRAVITY, acceleration_in, averaged
from rig.report.numbers import plus_minus
from rig.report.parts import means_of, summary_incline
from rig.report.templates import sentence

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.analysis.session import Analysis
    from rig.analysis.summary import Incline
    from rig.measurands import Measurand

MOST_NUMBERS = 3
_REFERENCES = {
    GRAVITY: "the protocol's gravity",
    ACCELERATION: "the acceleration without friction",
}
"""What strikes nothing is compared with."""


class Number(NamedTuple):
    """A number for a card: what it is, its value ± U, its unit, and of which incline."""

    quantity: str
    value: str
    unit: str
    place: str = ""

    @property
    def words(self) -> str:
        """What it is, and where."""
        return f"{self.quantity} at {self.place}" if self.place else self.quantity


class ModelCheck(NamedTuple):
    """Whether measurement and prediction agree, in one sentence."""

    sentence: str
    agrees: bool


def finding(analysis: Analysis) -> str:
    """Say how many drops there were, what they gave with U, and whether the model agrees."""
    summary = analysis.summary
    return sentence("finding", analysis, headline(summary), verdict(summary).sentence)


def headline(summary: Sequence[Incline]) -> list[Number]:
    """Choose at most three numbers: the largest and least mean, or what one differs by."""
    numbers: list[Number] = []
    for row in averaged():
        means = sorted(means_of(summary, row), key=lambda mean: -mean.mean.value)
        for line, _ in means[:1] if numbers or len(means) < 2 else (means[0], means[-1]):
            value = plus_minus(line.means[row.name], row.scale, row.decimals)
            quantity = row.symbol if row in _REFERENCES else f"{row.title} {row.symbol}"
            numbers.append(
                Number(quantity, value, row.unit, _place(line) if len(means) > 1 else "")
            )
    for row in averaged():
        if len(summary) == 1 and row.name in summary[0].differences:
            difference = summary[0].differences[row.name]
            value = plus_minus(difference, row.fine_scale, row.fine_decimals)
            numbers.append(Number(f"{row.symbol} − {_expected(row)}", value, row.fine))
    return numbers[:MOST_NUMBERS]


def claims(summary: Sequence[Incline]) -> list[str]:
    """Say the numbers in a sentence."""
    free = acceleration_in({name for line in summary for name in line.means})
    return [sentence("claim", summary, headline(summary), free)] if summary else []


def verdict(summary: Sequence[Incline]) -> ModelCheck:
    """Say in one sentence whether means and predictions agree within U."""
    rows = [row for row in averaged() if any(row.name in line.differences for line in summary)]
    off = [mean for row in rows for mean in means_of(summary, row) if abs(mean.error or 0.0) > 1.0]
    worst = max(off, key=lambda mean: abs(mean.error or 0.0), default=None)
    row = worst.row if worst else next(iter(rows), None)
    where = f" at {_place(worst.line)}" if worst and len(summary) > 1 else ""
    expected = _expected(row) if row else ""
    return ModelCheck(sentence("verdict", summary, rows, off, worst, expected, where), not off)


def _expected(row: Measurand) -> str:
    return _REFERENCES.get(row, "the model")


def _place(line: Incline) -> str:
    striker = f", {line.impact_chain} strikes" if line.impact_chain else ""
    return f"{summary_incline(line)}°{striker}"
