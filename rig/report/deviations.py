"""How a session went on otherwise than its protocol planned."""

from __future__ import annotations

from itertools import groupby, pairwise
from typing import TYPE_CHECKING

from rig.protocol.plan import runs as planned_runs
from rig.reasons import sentences
from rig.session.schema import RunState

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from rig.analysis.session import Analysis
    from rig.protocol.protocol import Protocol
    from rig.session.reading import StateEntry

NONE = "Nothing: every planned run was made once, in the order of the plan."


def deviations(protocol: Protocol, analysis: Analysis, states: Sequence[StateEntry]) -> list[str]:
    """Say what was left out, made again, interrupted, rejected or made in another order.

    Parameters
    ----------
    states
        The session's log, in order.

    Returns
    -------
    list of str
        Sentences; that there is nothing to say is one too.
    """
    return list(_sentences(protocol, analysis, states)) or [NONE]


def _sentences(
    protocol: Protocol, analysis: Analysis, states: Sequence[StateEntry]
) -> Iterator[str]:
    made = {one.run.number for one in analysis.runs}
    missing = [run.number for run in planned_runs(protocol) if run.number not in made]
    if missing:
        yield f"Not made: {_numbers('run', missing)}."
    for number, attempts in groupby(analysis.superseded, key=lambda one: one.run.number):
        earlier = [f"attempt {one.attempt} was {one.verdict}" for one in attempts]
        yield f"Made again: run {number} ({', '.join(earlier)})."
    for entry in states:
        if entry.state is RunState.INTERRUPTED:
            why = f": {sentences(entry.reasons)}" if entry.reasons else ""
            yield f"Interrupted: run {entry.run}, attempt {entry.attempt}{why}."
    rejected = [one.run.number for one in analysis.runs if one.verdict == "rejected"]
    if rejected:
        yield f"Rejected by the operator: {_numbers('run', rejected)}."
    first = list(dict.fromkeys(entry.run for entry in states if entry.state is RunState.RECORDED))
    late = [after for before, after in pairwise(first) if after < before]
    if late:
        yield f"Not in the order of the plan: {_numbers('run', late)} came after later ones."


def _numbers(noun: str, numbers: Iterable[int]) -> str:
    """Write numbers, neighbours together: runs 3, 5–8."""
    spans: list[tuple[int, int]] = []
    for number in sorted(set(numbers)):
        if spans and spans[-1][1] == number - 1:
            spans[-1] = spans[-1][0], number
        else:
            spans.append((number, number))
    told = [f"{low}" if low == high else f"{low}–{high}" for low, high in spans]
    return f"{noun}{'s' if len(told) > 1 or '–' in told[0] else ''} {', '.join(told)}"
