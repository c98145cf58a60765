"""What a session found, in plain sentences: a report's first paragraph, and a run's last words."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.measurands import ACCELERATION, GRAVITY, averaged
from rig.report.columns import DISAGREES, summary_incline, verdict_on
from rig.report.numbers import fixed, plus_minus

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.analysis.session import Analysis
    from rig.analysis.summary import Incline
    from rig.measurands import Measurand


_FREE = {GRAVITY: "the protocol's gravity", ACCELERATION: "what there would be without friction"}
"""What strikes nothing, and what it is compared with."""


def finding(analysis: Analysis) -> str:
    """Say how many drops there were, what they gave with U, and whether the model agrees.

    Returns
    -------
    str
        Two or three sentences.
    """
    said = [raised(counted(analysis))]
    if analysis.summary:
        shown = [row for row in averaged() if _lines(analysis.summary, row)]
        said.append("; ".join(_range(_lines(analysis.summary, row), row) for row in shown))
        said.append(raised(_agreement(analysis.summary, shown)))
    elif analysis.runs:
        said.append("No mean can be given")
    return " ".join(f"{one}." for one in said)


def raised(text: str) -> str:
    """Begin text with a capital; not for what begins with a symbol, since g is not G."""
    return text[:1].upper() + text[1:]


def counted(analysis: Analysis) -> str:
    """Count runs, drops and what became of them."""
    if not analysis.runs:
        return "no run was recorded"
    drops = (*analysis.runs, *analysis.superseded)
    words = [_many(len(analysis.runs), "run"), _many(len(drops), "drop")]
    verdicts = [one.verdict for one in drops]
    words += [
        f"{verdicts.count(verdict)} {verdict}"
        for verdict in ("marginal", "void", "rejected")
        if verdict in verdicts
    ]
    return ", ".join(words)


def _many(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def _lines(summary: Sequence[Incline], row: Measurand) -> list[Incline]:
    return [line for line in summary if row.name in line.means]


def _where(line: Incline) -> str:
    striker = f", {line.impact_chain} strikes" if line.impact_chain else ""
    return f"{summary_incline(line)}°{striker}"


def _range(lines: Sequence[Incline], row: Measurand) -> str:
    """Give the value, or the least and the greatest of several."""

    def told(line: Incline) -> str:
        value = plus_minus(line.means[row.name], row.scale, row.decimals)
        return f"{value} {row.unit}" + ("" if row in _FREE else f" at {_where(line)}")

    least, most = (pick(lines, key=lambda line: line.means[row.name].value) for pick in (min, max))
    if least is most:
        return f"{row.symbol} = {told(least)} (± U, 95 %)"
    return f"{row.symbol} from {told(least)} to {told(most)} (± U, 95 %)"


def _agreement(summary: Sequence[Incline], rows: Sequence[Measurand]) -> str:
    """Say of each quantity at how many inclines measurement and prediction agree."""
    whole, parts = [], []
    for row in rows:
        errors = [
            (line, error)
            for line in _lines(summary, row)
            if (error := line.normalized_error(row.name)) is not None
        ]
        off = [(line, error) for line, error in errors if verdict_on(error) == DISAGREES]
        if row in _FREE and errors:
            words = "does not agree" if off else "agrees"
            return f"within U it {words} with {_FREE[row]} (Eₙ {fixed(errors[0][1], 2)})"
        if off:
            named = ", ".join(f"{_where(line)}: Eₙ {fixed(error, 2)}" for line, error in off)
            parts.append(f"{row.symbol} disagrees at {len(off)} of {len(errors)} ({named})")
        elif errors:
            whole.append(row.symbol)
    if not whole and not parts:
        return "there is no prediction to compare with"
    agree = [f"{' and '.join(whole)} agree{'s' if len(whole) == 1 else ''}"] if whole else []
    return f"with the model {', '.join([*agree, *parts])} within U"
