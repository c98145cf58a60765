"""Blind sessions: results withheld until the session is unblinded.

A session is blind if its protocol has ``blind: true``, until `Session.unblind` stores the time of
unblinding in the session file, once. Until then release skews, edge counts and verdicts are shown;
measured values, means, fits and everything derived from them are withheld. This happens here, below
all code that shows results.
"""

from __future__ import annotations

from dataclasses import replace

from rig.analysis.result import DropResult
from rig.analysis.session import Analysis
from rig.measurands import RELEASE_SKEW


def veiled_drop(result: DropResult) -> DropResult:
    """Return a drop's result without measured values."""
    shown_names = {RELEASE_SKEW.name} & result.quantities.keys()
    return replace(
        result,
        quantities={name: result.quantities[name] for name in shown_names},
        rods=(),
        unmatched=(),
        last_passages={},
        gates=(),
        alone={},
        gravity=None,
    )


def veil(analysis: Analysis) -> Analysis:
    """Return an analysis without measured values and everything derived from them."""
    return Analysis(
        tuple(map(veiled_drop, analysis.runs)), tuple(map(veiled_drop, analysis.superseded)), ()
    )
