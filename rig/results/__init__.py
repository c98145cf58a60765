"""Everything that is derived from a session file, and can be derived again at any time."""

from rig.clock.calibration import Calibration
from rig.results.blind import check_open, kept_back
from rig.results.whole import (
    SessionResults,
    calibration,
    detailed,
    protocol_of,
    rejected,
    results,
    tick_rates,
)

__all__ = [
    "Calibration",
    "SessionResults",
    "calibration",
    "check_open",
    "detailed",
    "kept_back",
    "protocol_of",
    "rejected",
    "results",
    "tick_rates",
]
