"""Everything that is derived from a session file, and can be derived again at any time."""

from rig.clock.calibration import Calibration
from rig.results.blind import check_open, kept_back
from rig.results.whole import (
    SessionResults,
    calibration,
    complete_analysis,
    detailed,
    protocol_of,
    rejected,
    results,
)

__all__ = [
    "Calibration",
    "SessionResults",
    "calibration",
    "check_open",
    "complete_analysis",
    "detailed",
    "kept_back",
    "protocol_of",
    "rejected",
    "results",
]
