"""Everything that is derived from a session file, and can be derived again at any time."""

from rig.clock.calibration import Calibration
from rig.results.whole import (
    calibration,
    detailed,
    protocol_of,
    rejected,
    results,
    tick_rates,
    with_analysis,
)

__all__ = [
    "Calibration",
    "calibration",
    "detailed",
    "protocol_of",
    "rejected",
    "results",
    "tick_rates",
    "with_analysis",
]
