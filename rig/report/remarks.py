"""Remarks below results: void drops, shared errors, clock, air."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING, Any

from rig.measurands import averaged, told
from rig.reasons import remedies, summarize_reasons
from rig.report.numbers import decimals_for, fixed
from rig.report.templates import sentence
from rig.results.improvements import improvements

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rig.analysis.result import DropResult, Measured
    from rig.analysis.session import Analysis
    from rig.analysis.summary import Incline
    from rig.reasons import Reason
    from rig.results import SessionResults

_CLOCK_COVERAGE = 2.0  # about 95 %
_ALONE = "the joint fit of all good runs did not converge: each run is shown by itself"
_SIGNIFICANT = 4.0  # standard uncertainties beyond which κ is worth a remark


def remarks(results: SessionResults) -> list[str]:
    """Return the remarks on a session's falls, clock and air."""
    rig = results.analysis.rig
    return [
        *([_ALONE] if results.analysis.unsettled else []),
        *([rig.likeness.sentence] if rig is not None and rig.likeness is not None else []),
        *alone_lines(results.analysis),
        *common_lines(results.analysis.summary),
        *(each.sentence for each in improvements(results.analysis.summary)),
        *clock_lines(results.calibration),
        *air_lines(None if rig is None else rig.drag),
    ]


def common_lines(summary: Sequence[Incline]) -> list[str]:
    """Name the largest systematic errors that all means share."""
    causes: dict[str, None] = {}
    for row in averaged():
        budgets = [line.causes[row.name] for line in summary if line.causes.get(row.name)]
        if budgets:
            most = {name: max(part.get(name, 0.0) for part in budgets) for name in budgets[0]}
            largest = [name for name, u in most.items() if u > 0.5 * max(most.values())]
            causes |= dict.fromkeys(sorted(largest, key=lambda name: -most[name]))
    return [sentence("shared", ", ".join(causes))] if causes else []


def alone_lines(analysis: Analysis) -> list[str]:
    """Set what the last good run says by itself beside what it says among all, and say why."""
    runs = [run for run in analysis.runs if run.learned]
    row = next((row for row in told() if runs and row.name in runs[-1].alone), None)
    if row is None:
        return []
    return [sentence("alone", runs[-1], row, len(runs))]


def void_lines(analysis: Analysis) -> list[str]:
    """Return why drops are void, a line for each kind of reason, and what to do about them."""
    drops = sorted(
        (*analysis.runs, *analysis.superseded), key=lambda drop: (drop.run.number, drop.attempt)
    )
    voids = [drop for drop in drops if drop.verdict == "void"]
    kinds: dict[tuple[object, ...], list[tuple[DropResult, Reason]]] = defaultdict(list)
    for drop in voids:
        for reason in drop.reasons:
            kinds[reason.kind].append((drop, reason))
    groups = [
        ([drop for drop, _ in members], summarize_reasons([reason for _, reason in members]))
        for members in kinds.values()
    ]
    advice = remedies(reason for drop in voids for reason in drop.reasons)
    return sentence("void", groups, advice).split("\n") if voids else []


def clock_lines(calibration: Mapping[str, Any]) -> list[str]:
    """Say what times are corrected by, and how well that is known.

    Parameters
    ----------
    calibration
        Member of ``rig analyze --json``.
    """
    expanded = _CLOCK_COVERAGE * calibration["u_ppm"]
    u = fixed(expanded, max(decimals_for(expanded) - 1, 0))
    return [sentence("clock", calibration, u), *calibration["notes"]]


def air_lines(drag: Measured | None) -> list[str]:
    """State the air drag that a fit finds, where it is significant: predictions ignore it."""
    significant = drag is not None and abs(drag.value) > _SIGNIFICANT * drag.u
    return [sentence("air", drag)] if significant else []
