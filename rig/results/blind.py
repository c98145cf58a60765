"""Blind sessions: results withheld until the session is unblinded.

A session is blind if its protocol has ``blind: true``, until `Session.unblind` stores the time of
unblinding in the session file, once. Until then release skews, edge counts and verdicts are shown;
measured values, means, fits and everything derived from them are withheld. This happens here, below
all code that shows results.
"""

from rig.analysis.last_passages import CODES
from rig.analysis.result import DropResult
from rig.analysis.session import Analysis
from rig.measurands import RELEASE_SKEW
from rig.reasons import make_reason

_TELLING = {*CODES.values(), "other_incline"}
"""Reasons that state measured values; none makes a drop void."""


def veiled_drop(result: DropResult) -> DropResult:
    """Return what may be seen of a drop's result: all but measured values."""
    shown = [reason for reason in result.reasons if reason.code not in _TELLING]
    if any(reason.code in CODES.values() for reason in result.reasons):
        shown.append(make_reason("last_passages_differ"))
    drop = result.run, result.attempt, result.verdict, (*shown,), result.audit
    skews = {name: m for name, m in result.quantities.items() if name == RELEASE_SKEW.name}
    scatter, limits, damaged = result.scatter, result.limits, result.damaged
    return DropResult(*drop, skews, scatter=scatter, limits=limits, damaged=damaged)


def veil(analysis: Analysis) -> Analysis:
    """Return an analysis without measured values and everything derived from them."""
    return Analysis(
        tuple(map(veiled_drop, analysis.runs)), tuple(map(veiled_drop, analysis.superseded)), ()
    )
