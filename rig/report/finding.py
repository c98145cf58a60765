"""Plain sentences about a session: its card, remarks on its results, deviations from its plan."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

from rig.analysis.session import Analysis
from rig.analysis.summary import Incline
from rig.measurands import ACCELERATION, GRAVITY, Measurand, acceleration_in, averaged
from rig.protocol.protocol import Protocol
from rig.reasons import remedies, summarize_reasons
from rig.report.numbers import plus_minus
from rig.report.parts import means_of
from rig.report.templates import lines, sentence
from rig.results.improvements import improvements
from rig.results.whole import SessionResults
from rig.session.reading import StateEntry
from rig.session.schema import RunState

MOST_NUMBERS = 3
_REFERENCES = {GRAVITY: "the protocol's gravity", ACCELERATION: "the acceleration without friction"}
"""Reference values of scenes without impacts."""
NONE = "No deviations: every planned run was recorded once, in the planned order."


class Number(NamedTuple):
    """A number for a card: quantity, value ± U, unit and incline."""

    quantity: str
    value: str
    unit: str
    place: str = ""

    @property
    def words(self) -> str:
        """Quantity and incline in words."""
        return f"{self.quantity} at {self.place}" if self.place else self.quantity


class ModelCheck(NamedTuple):
    """Agreement of measurement and prediction, with a sentence."""

    sentence: str
    agrees: bool


def finding(analysis: Analysis) -> str:
    """Return a sentence with the number of drops, the result with U, and the model check."""
    summary = analysis.summary
    return sentence("finding", analysis, headline(summary), verdict(summary).sentence)


def headline(summary: Sequence[Incline]) -> list[Number]:
    """Return at most three numbers: the largest and smallest mean, or a mean and its difference."""
    numbers: list[Number] = []
    for row in averaged():
        means = sorted(means_of(summary, row), key=lambda mean: -mean.mean.value)
        for line, _ in means[:1] if numbers or len(means) < 2 else (means[0], means[-1]):
            value = plus_minus(line.means[row.name], row.scale, row.decimals)
            quantity = row.symbol if row in _REFERENCES else f"{row.title} {row.symbol}"
            place = _place(line) if len(means) > 1 else ""
            numbers.append(Number(quantity, value, row.unit, place))
    differences = summary[0].differences if len(summary) == 1 else {}
    for row in averaged(differences):
        value = plus_minus(differences[row.name], row.fine_scale, row.fine_decimals)
        numbers.append(Number(f"{row.symbol} − {_reference(row)}", value, row.fine))
    return numbers[:MOST_NUMBERS]


def verdict(summary: Sequence[Incline]) -> ModelCheck:
    """Return whether means and predictions agree within U, with a sentence."""
    rows = [row for row in averaged() if any(row.name in line.differences for line in summary)]
    off = [mean for row in rows for mean in means_of(summary, row) if abs(mean.error or 0.0) > 1.0]
    worst = max(off, key=lambda mean: abs(mean.error or 0.0), default=None)
    row = worst.row if worst else next(iter(rows), None)
    where = f" at {_place(worst.line)}" if worst and len(summary) > 1 else ""
    expected = _reference(row) if row else ""
    return ModelCheck(sentence("verdict", summary, rows, off, worst, expected, where), not off)


def _reference(row: Measurand) -> str:
    return _REFERENCES.get(row, "the model")


def _place(line: Incline) -> str:
    """Return the condition of a mean in words; an acceleration has no incline."""
    condition = line.condition
    return condition.setting if acceleration_in(line.means) else f"{condition}".replace(" deg", "°")


def remarks(results: SessionResults) -> list[str]:
    """Return the remarks on a session's falls, clock and air."""
    return [
        *lines("fitted", results.analysis),
        *lines("alone", results.analysis),
        *common_lines(results.analysis.summary),
        *(each.sentence for each in improvements(results.analysis.summary)),
        *clock_lines(results.calibration),
        *lines("air", results.analysis),
    ]


def common_lines(summary: Sequence[Incline]) -> list[str]:
    """Return lines about the largest systematic errors that all means share."""
    causes: dict[str, None] = {}
    for row in averaged():
        budgets = [line.causes[row.name] for line in summary if line.causes.get(row.name)]
        first = [name for part in budgets[:1] for name in part]
        most = {name: max(part.get(name, 0.0) for part in budgets) for name in first}
        largest = [name for name, u in most.items() if u > 0.5 * max(most.values())]
        causes |= dict.fromkeys(sorted(largest, key=lambda name: -most[name]))
    return lines("shared", causes)


def void_lines(analysis: Analysis) -> list[str]:
    """Return lines about void drops, one for each kind of reason, with a remedy."""
    voids = [drop for drop in analysis.drops if drop.verdict == "void"]
    kinds = defaultdict[Any, list[Any]](list)
    for drop in voids:
        for reason in drop.reasons:
            kinds[reason.kind].append((drop, reason))
    members = (zip(*group, strict=True) for group in kinds.values())
    groups = [(drops, summarize_reasons(reasons)) for drops, reasons in members]
    advice = remedies(reason for drop in voids for reason in drop.reasons)
    return lines("void", groups, advice) if voids else []


def clock_lines(calibration: Mapping[str, Any]) -> list[str]:
    """Return lines about the correction of times and its uncertainty.

    Parameters
    ----------
    calibration
        Member of ``rig analyze --json``.
    """
    return [sentence("clock", calibration), *calibration["notes"]]


def deviations(protocol: Protocol, analysis: Analysis, states: Sequence[StateEntry]) -> list[str]:
    """Return sentences about omitted, repeated, interrupted, rejected or reordered runs.

    Parameters
    ----------
    states
        The session's log, in order.

    Returns
    -------
    list of str
        Sentences; only `NONE` without deviations.
    """
    first = dict.fromkeys(entry.run for entry in states if entry.state is RunState.RECORDED)
    late = [after for before, after in pairwise(first) if after < before]
    return lines("deviations", analysis, states, protocol.runs(), late) or [NONE]
