"""What a session says in plain sentences: the card of a report, the last words of a run."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from rig.measurands import ACCELERATION, GRAVITY, averaged
from rig.report.columns import summary_incline
from rig.report.numbers import fixed, plus_minus

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
    """A number for a card: what it is, its value ± U, and its unit."""

    words: str
    value: str
    unit: str


class ModelCheck(NamedTuple):
    """Whether measurement and prediction agree, in one sentence."""

    sentence: str
    agrees: bool


def finding(analysis: Analysis) -> str:
    """Say how many drops there were, what they gave with U, and whether the model agrees."""
    if not analysis.summary:
        return f"{raised(counted(analysis))}.{' No mean can be given.' if analysis.runs else ''}"
    numbers = "; ".join(
        f"{number.words} = {number.value} {number.unit}" for number in headline(analysis.summary)
    )
    return (
        f"{raised(counted(analysis))}. {numbers} (± U, 95 %). {verdict(analysis.summary).sentence}"
    )


def raised(text: str) -> str:
    """Begin text with a capital; not for what begins with a symbol, since g is not G."""
    return text[:1].upper() + text[1:]


def counted(analysis: Analysis) -> str:
    """Count runs, drops and what became of them."""
    if not analysis.runs:
        return "no run was recorded"
    drops = (*analysis.runs, *analysis.superseded)
    verdicts = [drop.verdict for drop in drops]
    words = [count(len(analysis.runs), "run"), count(len(drops), "drop")]
    words += [
        f"{verdicts.count(name)} {name}"
        for name in ("marginal", "void", "rejected")
        if name in verdicts
    ]
    return ", ".join(words)


def count(number: int, noun: str) -> str:
    """Write a number with its noun."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def headline(summary: Sequence[Incline]) -> list[Number]:
    """Choose at most three numbers: the largest and least mean, or what one differs by."""
    numbers: list[Number] = []
    for row in averaged():
        lines = sorted(_lines(summary, row), key=lambda line: -line.means[row.name].value)
        several = len(lines) > 1
        ends = [lines[0], lines[-1]] if several and not numbers else lines[:1]
        numbers += [_number(line, row, several=several) for line in ends]
    for row in averaged():
        if len(summary) == 1 and row.name in summary[0].differences:
            difference = summary[0].differences[row.name]
            value = plus_minus(difference, row.fine_scale, row.fine_decimals)
            numbers.append(Number(f"{row.symbol} − {_expected(row)}", value, row.fine))
    return numbers[:MOST_NUMBERS]


def verdict(summary: Sequence[Incline]) -> ModelCheck:
    """Say in one sentence whether means and predictions agree within U."""
    rows = [row for row in averaged() if any(row.name in line.differences for line in summary)]
    if not rows:
        return ModelCheck("There is no prediction to compare with.", agrees=True)
    off = [
        (abs(error), line, row)
        for row in rows
        for line in _lines(summary, row)
        if (error := line.normalized_error(row.name)) is not None and abs(error) > 1.0
    ]
    symbols = " and ".join(row.symbol for row in rows)
    if not off:
        number = {1: "", 2: " at both inclines"}
        where = number.get(len(summary), f" at all {len(summary)} inclines")
        verb = "agree" if len(rows) > 1 else "agrees"
        return ModelCheck(
            f"{symbols} {verb} with {_expected(rows[0])}{where}, within U.", agrees=True
        )
    _, line, row = max(off, key=lambda each: each[0])
    difference = line.differences[row.name]
    places = {(each.incline_deg, each.impact_chain) for _, each, _ in off}
    often = f" at {len(places)} of {count(len(summary), 'incline')}" if len(summary) > 1 else ""
    size, normal = (
        fixed(abs(value) * row.fine_scale, max(0, row.fine_decimals - 1))
        for value in (difference.value, difference.expanded)
    )
    where = f" at {_where(line)}" if len(summary) > 1 else ""
    names = " and ".join(dict.fromkeys(each.symbol for _, _, each in off))
    verb = "differ" if " and " in names else "differs"
    return ModelCheck(
        f"{names} {verb} from {_expected(row)}{often}: {row.symbol}{where} by {size} {row.fine}, "
        f"where ± {normal} {row.fine} would be normal.",
        agrees=False,
    )


def _lines(summary: Sequence[Incline], row: Measurand) -> list[Incline]:
    return [line for line in summary if row.name in line.means]


def _number(line: Incline, row: Measurand, *, several: bool) -> Number:
    where = f" at {_where(line)}" if several else ""
    value = plus_minus(line.means[row.name], row.scale, row.decimals)
    words = f"{row.title} {row.symbol}{where}" if row not in _REFERENCES else row.symbol
    return Number(words, value, row.unit)


def _expected(row: Measurand) -> str:
    return _REFERENCES.get(row, "the model")


def _where(line: Incline) -> str:
    striker = f", {line.impact_chain} strikes" if line.impact_chain else ""
    return f"{summary_incline(line)}°{striker}"
