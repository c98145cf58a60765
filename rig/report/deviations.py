"""Where a session departed from the plan of its protocol."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

from rig.protocol.plan import runs as planned_runs
from rig.reasons import sentences
from rig.report.templates import sentence
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
    recorded = {drop.run.number for drop in analysis.runs}
    missing = [run.number for run in planned_runs(protocol) if run.number not in recorded]
    first = dict.fromkeys(entry.run for entry in states if entry.state is RunState.RECORDED)
    late = [after for before, after in pairwise(first) if after < before]
    interrupted = [
        (entry, sentences(entry.reasons)) for entry in states if entry.state is RunState.INTERRUPTED
    ]
    return sentence("deviations", analysis, missing, interrupted, late).split("\n")[1:] or [NONE]
