"""Results of a session file: all derived data, which can be computed again at any time."""

from rig.clock.calibration import Calibration
from rig.results.blind import check_open, kept_back
from rig.results.whole import (
    SessionResults,
    calibration,
    complete_analysis,
    protocol_of,
    rejected_drops,
    results,
)

__all__ = [
    "Calibration",
    "SessionResults",
    "calibration",
    "check_open",
    "complete_analysis",
    "kept_back",
    "protocol_of",
    "rejected_drops",
    "results",
]
