"""What is remarked below results: why drops are void, where seconds come from, the air's share."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from rig.analysis.likeness import likeness
from rig.analysis.result import Measured
from rig.measurands import averaged
from rig.reasons import remedies, sentences
from rig.report.columns import run_incline
from rig.report.numbers import decimals_for, fixed, plus_minus, signed

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rig.analysis.joint_fit import JointFit
    from rig.analysis.session import Analysis
    from rig.analysis.summary import Incline
    from rig.results import SessionResults

_CLOCK_COVERAGE = 2.0  # about 95 %
_ALONE = "the joint fit of all good runs did not converge: each run is shown by itself"
_FOUND = 4.0  # standard uncertainties beyond which κ is worth a remark


def remarks(found: SessionResults) -> list[str]:
    """Make the remarks on a session's falls, clock and air."""
    fitted = joint = found.analysis.joint
    if joint is not None and joint.drops[0].model.protocol.drag is not None:
        joint = None  # predictions are made in this air
    return [
        *([_ALONE] if found.analysis.unsettled else []),
        *model_lines(fitted),
        *common_lines(found.analysis.summary),
        *clock_lines(found.calibration),
        *air_lines(joint),
    ]


def common_lines(summary: Sequence[Incline]) -> list[str]:
    """Say what all means share, so that their errors, and Eₙ, go up and down together."""
    told = []
    for row in averaged():
        lines = [line.causes[row.name] for line in summary if line.causes.get(row.name)]
        if lines:
            most = {name: max(one.get(name, 0.0) for one in lines) for name in lines[0]}
            first = [name for name, u in most.items() if u > 0.5 * max(most.values())]
            told.append(f"{row.symbol} by {' and '.join(sorted(first, key=lambda n: -most[n]))}")
    if not told:
        return []
    return [
        "means share errors that no number of runs averages, and their Eₙ go up and down together: "
        f"{'; '.join(told)}"
    ]


def model_lines(joint: JointFit | None) -> list[str]:
    """Say whether the falls look like the model, where that can be told."""
    found = None if joint is None else likeness(joint)
    return [] if found is None else [found.sentence]


def void_lines(analysis: Analysis) -> list[str]:
    """Say of every void drop why, a line each, and below them what to do."""
    drops = sorted(
        (*analysis.runs, *analysis.superseded), key=lambda one: (one.run.number, one.attempt)
    )
    voids = [one for one in drops if one.verdict == "void"]
    if not voids:
        return []
    lines = ["void drops:"]
    for one in voids:
        tilt = run_incline(one)
        at = f" at {tilt}°" if tilt else ""
        reasons = signed(sentences(one.reasons))
        lines.append(f"  run {one.run.number}, attempt {one.attempt}{at}: {reasons}")
    what = remedies(reason for one in voids for reason in one.reasons)
    return [*lines, "what to do:", *(f"  {one}" for one in what)]


def clock_lines(said: Mapping[str, Any]) -> list[str]:
    """Say in words where seconds come from, and what to know before trusting them.

    Parameters
    ----------
    said
        ``calibration`` of ``rig analyze --json``.
    """
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
    rate = fixed(said["rate_ppm"], decimals_for(expanded))
    return [f"time scale: board {rate} ± {u} ppm off (95 %), {where}", *said["notes"]]


def air_lines(joint: JointFit | None) -> list[str]:
    """Say what the air took, where it is more than nothing: the predictions are without it."""
    block = None if joint is None else joint.shared.blocks.get("drag")
    if joint is None or block is None:
        return []
    value = float(joint.x[block][0])
    u = math.sqrt(joint.covariance.diagonal()[block][0]) * float(joint.sd[block][0])
    if abs(value) <= _FOUND * u:
        return []
    return [
        f"air: takes κv² from g, κ = {plus_minus(Measured(value, u))} per m; what is measured is "
        "in this air, what is predicted is not (rig estimate takes it into account)"
    ]
