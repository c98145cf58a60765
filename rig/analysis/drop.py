"""One drop, from its edges to its results."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rig.analysis.chain_records import chain_records
from rig.analysis.components import STATED, Components
from rig.analysis.edge_classes import unmatched_edges
from rig.analysis.explanations import Explainer, Premise, explained, faults
from rig.analysis.identify import identify
from rig.analysis.quantities import quantities
from rig.analysis.result import Audit, DropResult
from rig.analysis.verdict import judge, pattern_faults
from rig.threads import one_thread

_FEW_GATES = 6  # that all may be suspected where nothing is known
_SUSPECTS = 6  # of which any two may be exchanged

if TYPE_CHECKING:
    from rig.analysis.fit import Fit
    from rig.analysis.verdict import Judgement
    from rig.clock.calibration import TimeScale
    from rig.protocol.protocol import Protocol, Run
    from rig.records import Drop


def analyze_drop(
    protocol: Protocol,
    run: Run,
    drop: Drop,
    scale: TimeScale,
    components: Components = STATED,
) -> DropResult:
    """Find out what a drop says by itself.

    Parameters
    ----------
    protocol
        The scene; it must have gates.
    run
        The planned run that the drop was.
    drop
        The raw record.
    scale
        Calibration of its ticks.
    components
        How much everything scatters.
    """
    return fit_drop(protocol, run, drop, scale, components)[0]


@one_thread
def fit_drop(
    protocol: Protocol,
    run: Run,
    drop: Drop,
    scale: TimeScale,
    components: Components = STATED,
    *,
    explain: bool = True,
) -> tuple[DropResult, Fit | None]:
    """Like `analyze_drop`; keep what a joint fit begins with, too.

    Parameters
    ----------
    explain
        Whether to seek what else than the protocol would explain a drop that is odd: it takes a
        hundred times as long as all the rest.
    """
    records = chain_records(protocol, run, drop, scale.hz)
    received = sum(part.times.size for record in records for part in record.trains)
    expected = sum(record.expected for record in records)
    lost = 0
    if drop.certificate is not None:
        lost = drop.certificate.overflows
    blank = Audit(received, 0, expected, received, lost)
    window = (-math.inf if drop.fire_tick is None else 0.0, math.inf)
    identified = identify(protocol, records, scale.u, components, window)
    unlike = pattern_faults(identified)
    early = judge(protocol, drop, dict.fromkeys(unlike.values()), blank, {}, None)
    if early.verdict == "void" or identified.fit is None:
        reasons = early.reasons
        if unlike and explain:
            reasons = (*reasons, *_explained(protocol, run, drop, scale, components, early))
        return DropResult(run, drop.attempt, early.verdict, reasons, blank), None
    fit = identified.fit
    audit = blank.after(fit.matched)
    found = quantities(fit.model, fit.estimate)
    end = judge(protocol, drop, (), audit, found, fit)
    verdict, reasons = end.verdict, end.reasons
    why = _explained(protocol, run, drop, scale, components, end) if end.odd and explain else []
    if why:
        verdict = "void"
        reasons = (*(one for one in reasons if one not in end.accused), *why)
    result = DropResult(
        run,
        drop.attempt,
        verdict,
        reasons,
        audit,
        found,
        fit.rods,
        fit.estimate.scatter,
        unmatched=unmatched_edges(fit),
    )
    return result, fit


def _explained(
    protocol: Protocol,
    run: Run,
    drop: Drop,
    scale: TimeScale,
    components: Components,
    judged: Judgement,
) -> list[str]:
    """Say what else than the protocol would explain a drop that is odd; nothing where none does."""
    assert protocol.gates is not None
    suspects = judged.suspects
    if judged.verdict == "void" and not suspects and len(protocol.gates.gates) <= _FEW_GATES:
        suspects = tuple(range(len(protocol.gates.gates)))
    explainer = Explainer(Premise(protocol, run, scale.hz), drop, scale.u, components)
    weighed = explainer.explain(faults(protocol, run, suspects[:_SUSPECTS]))
    return explained(weighed, judged.accused)
