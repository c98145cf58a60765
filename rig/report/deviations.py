"""Where a session departed from the plan of its protocol."""

from __future__ import annotations

from itertools import groupby, pairwise
from typing import TYPE_CHECKING

from rig.protocol.plan import runs as planned_runs
from rig.reasons import sentences
from rig.report.numbers import ranges
from rig.session.schema import RunState

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.analysis.session import Analysis
    from rig.protocol.protocol import Protocol
    from rig.session.reading import StateEntry

NONE = "No deviations: every planned run was recorded once, in the planned order."


def deviations(protocol: Protocol, analysis: Analysis, states: Sequence[StateEntry]) -> list[str]:
    """List what was omitted, repeated, interrupted, rejected or recorded in another order.

    Parameters
    ----------
    states
        The session's log, in order.

    Returns
    -------
    list of str
        Sentences; `NONE` alone where there is no deviation.
    """
    words = []
    recorded = {drop.run.number for drop in analysis.runs}
    missing = [run.number for run in planned_runs(protocol) if run.number not in recorded]
    if missing:
        words.append(f"Not recorded: {ranges('run', missing)}.")
    for number, attempts in groupby(analysis.superseded, key=lambda drop: drop.run.number):
        earlier = [f"attempt {drop.attempt} was {drop.verdict}" for drop in attempts]
        words.append(f"Run {number} was repeated ({', '.join(earlier)}).")
    for entry in states:
        if entry.state is RunState.INTERRUPTED:
            why = f": {sentences(entry.reasons)}" if entry.reasons else ""
            words.append(f"Run {entry.run}, attempt {entry.attempt} was interrupted{why}.")
    rejected = [drop.run.number for drop in analysis.runs if drop.verdict == "rejected"]
    if rejected:
        words.append(f"Rejected by the operator: {ranges('run', rejected)}.")
    first = list(dict.fromkeys(entry.run for entry in states if entry.state is RunState.RECORDED))
    late = [after for before, after in pairwise(first) if after < before]
    if late:
        words.append(f"Out of the planned order: {ranges('run', late)}.")
    return words or [NONE]
