"""One drop, from its edges to its results."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.analysis.chain_records import chain_records
from rig.analysis.components import STATED, Components
from rig.analysis.diagnoses import diagnose_pattern
from rig.analysis.drop_model import DropModel
from rig.analysis.edge_classes import unmatched_edges
from rig.analysis.fit import Fit, settle
from rig.analysis.pattern import first_guesses
from rig.analysis.quantities import quantities
from rig.analysis.result import Audit, DropResult
from rig.analysis.verdict import judge, pattern_faults
from rig.threads import one_thread

if TYPE_CHECKING:
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
) -> tuple[DropResult, Fit | None]:
    """Like `analyze_drop`; keep what a joint fit begins with, too."""
    records = chain_records(protocol, run, drop, scale.hz)
    received = sum(part.times.size for record in records for part in record.trains)
    expected = sum(record.expected for record in records)
    lost = 0
    if drop.certificate is not None:
        lost = drop.certificate.overflows
    guesses = first_guesses(protocol, records)
    blank = Audit(received, 0, expected, received, lost)
    early = judge(protocol, drop, guesses, blank, {}, None)
    if early.verdict == "void":
        unlike = [role for role, one in guesses.items() if pattern_faults(role, one)]
        faults = diagnose_pattern(protocol, run, drop, scale.hz, records, unlike)
        reasons = (*early.reasons, *faults)
        return DropResult(run, drop.attempt, early.verdict, reasons, blank), None
    fit = settle(DropModel(protocol, records, guesses, scale.u, components))
    audit = blank.after(fit.matched)
    found = quantities(fit.model, fit.estimate)
    end = judge(protocol, drop, guesses, audit, found, fit)
    result = DropResult(
        run,
        drop.attempt,
        end.verdict,
        end.reasons,
        audit,
        found,
        fit.rods,
        fit.estimate.scatter,
        unmatched=unmatched_edges(fit),
    )
    return result, fit
