"""What is remarked below results: why drops are void, where seconds come from, the air's share."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rig.analysis.remedies import remedies, void_runs
from rig.report.columns import incline
from rig.report.numbers import decimals_for, fixed, plus_minus

if TYPE_CHECKING:
    from collections.abc import Mapping

_CLOCK_COVERAGE = 2.0  # about 95 %
_AIR_COVERAGE = 1.96
_FOUND = 4.0  # standard uncertainties beyond which κ is worth a remark


def void_lines(analysis: Mapping[str, Any]) -> list[str]:
    """Say of every void drop why, a line each, and below them what to do.

    Parameters
    ----------
    analysis
        What ``rig analyze --json`` prints.
    """
    voids = void_runs(analysis)
    if not voids:
        return []
    lines = ["void drops:"]
    for one in voids:
        tilt = incline(one)
        at = f" at {tilt}°" if tilt else ""
        reasons = "; ".join(one["reasons"])
        lines.append(f"  run {one['run']}, attempt {one['attempt']}{at}: {reasons}")
    what = remedies(reason for one in voids for reason in one["reasons"])
    return [*lines, "what to do:", *(f"  {one}" for one in what)]


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
    expanded = _CLOCK_COVERAGE * said["u_ppm"]
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


def air_lines(analysis: Mapping[str, Any]) -> list[str]:
    """Say what the air took, where it is more than nothing: the predictions are without it.

    Parameters
    ----------
    analysis
        What ``rig analyze --json`` prints.
    """
    for one in (analysis.get("learned") or {}).get("unknowns") or ():
        if one["name"] != "drag" or abs(one["value"][0]) <= _FOUND * one["u"][0]:
            continue
        kappa = {"value": one["value"][0], "U95": _AIR_COVERAGE * one["u"][0]}
        return [
            f"air: takes κv² from g, κ = {plus_minus(kappa)} per m; what is measured is in this "
            "air, what is predicted is not (rig estimate takes it into account)"
        ]
    return []
