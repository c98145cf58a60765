"""What a result says of its time scale."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rig.report.numbers import decimals_for, fixed

if TYPE_CHECKING:
    from collections.abc import Mapping

_COVERAGE = 2.0  # about 95 %


def clock_lines(analysis: Mapping[str, Any]) -> list[str]:
    """Say in words where seconds come from, and what to know before trusting them.

    Parameters
    ----------
    analysis
        What ``rig analyze --json`` prints.
    """
    said = analysis.get("calibration") or {}
    if not said:
        return []
    expanded = _COVERAGE * said["u_ppm"]
    u = fixed(expanded, decimals_for(expanded))
    if said["source"] == "pings":
        where = f"from {said['pings']} clock samples by the host's clock"
    elif said["source"] == "reference":
        where = f"from {said['pulses']} pulses of the 1 Hz reference"
    elif "nominal_tick_hz" in said:
        where = "as the board states it"
    else:
        return [f"time scale: as the file gives it, ± {u} ppm (95 %)", *said["notes"]]
    rate = fixed(said["rate_ppm"], 2)
    return [f"time scale: board {rate} ± {u} ppm off (95 %), {where}", *said["notes"]]
