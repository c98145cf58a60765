"""One drop, from its edges to its results."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from rig.analysis.budgets import Budgets
from rig.analysis.chain_records import chain_records, on_heap, thinned
from rig.analysis.components import Components, stated
from rig.analysis.diagnoses import FEW_GATES, silent
from rig.analysis.drop_model import DropModel
from rig.analysis.edge_classes import count_unexplained, unmatched_edges
from rig.analysis.explanations import Explainer, explained
from rig.analysis.faults import Premise
from rig.analysis.fit import timed
from rig.analysis.identified import IdentifiedByDrop, identified
from rig.analysis.joint_fit import by_itself
from rig.analysis.last_passages import last_passages
from rig.analysis.result import Audit, DropResult
from rig.analysis.verdict import judge, judge_record, verdict_of
from rig.protocol.contact import at_contact
from rig.reasons import make_reason
from rig.threads import one_thread
from rig.wordings import Severity

if TYPE_CHECKING:
    from rig.analysis.fit import Fit
    from rig.clock.calibration import TimeScale
    from rig.protocol.protocol import Protocol, Run
    from rig.records import Drop


@one_thread
def fit_drop(
    protocol: Protocol,
    run: Run,
    drop: Drop,
    scale: TimeScale,
    components: Components | None = None,
    *,
    explain: bool = True,
    known: IdentifiedByDrop | None = None,
) -> tuple[DropResult, Fit | None]:
    """Find out what a drop says by itself; keep what a joint fit begins with, too.

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
        How much everything scatters; as the protocol states it if not given.
    explain
        Whether to seek what else than the protocol would explain a drop that is void as it is: it
        takes many times as long as all the rest. Of others it is sought where they ask for it.
    known
        What was found out before about drops of this protocol, and is found out here. Results are
        the same with it and without.
    """
    if drop.damage:  # the file's, and no finding about chains or gates
        damaged = (make_reason("record_damaged", text=drop.damage),)
        return DropResult(run, drop.attempt, "void", damaged, Audit(), damaged=True), None
    known = {} if known is None else known
    protocol = at_contact(protocol, run.incline_deg, run.impact)
    heaped = on_heap(protocol, run)
    fit = partial(_fit_drop, run=run, drop=drop, scale=scale, components=components)
    as_stated = fit(protocol, explain=explain and heaped is None, known=known)
    wrong = _void_by(as_stated[0]) - {"release_skew"}
    if heaped is None or not wrong:
        return as_stated
    held = known.get(drop)
    assert held is not None  # the first fit found it out
    on_rods = {} if held.on_heap is None else {drop: held.on_heap}
    as_heaped = fit(heaped, explain=False, known=on_rods)
    known[drop] = replace(held, on_heap=on_rods[drop])
    # That no beam sees the end is why edges are strange, not why others are missed.
    hidden = {"rods_hide_end"} if wrong != {"edges_missed"} else set()
    if _void_by(as_heaped[0]) <= {"release_skew"} | hidden:
        return as_heaped
    return fit(protocol, explain=True, known=known) if explain else as_stated


def _void_by(result: DropResult) -> set[str]:
    """Return the codes of the reasons for which a drop is void."""
    return {reason.code for reason in result.reasons if reason.severity is Severity.VOID}


def _fit_drop(
    protocol: Protocol,
    run: Run,
    drop: Drop,
    scale: TimeScale,
    components: Components | None,
    *,
    explain: bool,
    known: IdentifiedByDrop,
) -> tuple[DropResult, Fit | None]:
    """Fit a drop whose rods strike where a protocol, counted from the contact point, has them."""
    components = components or stated(protocol)
    records = chain_records(protocol, run, drop, scale.hz)
    trains = [part for record in records for part in record.trains]
    left_out = sum(part.thinned for part in trains)
    received = sum(part.times.size for part in trains) + left_out
    expected = sum(record.expected for record in records)
    lost = 0 if drop.certificate is None else drop.certificate.overflows
    blank = Audit(received, 0, expected, received, lost, received - left_out, left_out)
    rough = scale.rounded()
    one = known.get(drop)
    if one is None or one.scale != rough:
        one = known[drop] = identified(protocol, run, drop, rough, components)
    unlike = {reason.text: reason for reason in one.unlike.values()}.values()
    early = judge_record(drop, blank, [*unlike, *(silent(protocol, records) if one.unlike else ())])
    if early.verdict == "void" or one.begun is None:
        reasons = early.reasons
        if one.unlike and explain:
            if one.explained is None:
                assert protocol.gates is not None
                gates = protocol.gates.gates
                strange = [n for n, gate in enumerate(gates) if gate.side in one.poor]
                if not strange and len(gates) <= FEW_GATES:
                    strange = [*range(len(gates))]  # each may see nearly what another should
                premise = Premise(protocol, run, rough.hz)
                short = thinned(drop, rough.hz)
                weigh = Explainer(premise, short, rough.u, components, strange)
                why = explained(weigh.explain(None), protocol.vocabulary)
                one = replace(one, explained=tuple(why))
                known[drop] = one
            reasons = (*reasons, *(one.explained or ()))
        return DropResult(run, drop.attempt, early.verdict, reasons, blank), None
    model = DropModel(protocol, records, one.begun.guesses, scale.u, components)
    if one.begun.x.size != len(model.unknowns):  # it was found out where other things were unknown
        known[drop] = identified(protocol, run, drop, rough, components)
        return _fit_drop(protocol, run, drop, scale, components, explain=explain, known=known)
    fit = timed(model, one.begun, scale.hz / rough.hz)
    unmatched = unmatched_edges(fit)
    audit = blank.count(fit.matched, count_unexplained(unmatched))
    joint = by_itself(fit)
    budgets = Budgets(joint)
    found = budgets.measured(joint.drops[0])
    if not all(math.isfinite(one.value) and math.isfinite(one.u) for one in found.values()):
        nothing = (make_reason("no_fall", protocol.vocabulary),)
        return DropResult(run, drop.attempt, "void", nothing, blank), None
    alone = last_passages(fit)
    end = judge(protocol, run, drop, audit, found, fit, alone, unmatched)
    reasons = end.reasons
    if not end.known and (explain or end.verdict != "void"):
        premise = Premise(protocol, run, scale.hz)
        short = thinned(drop, scale.hz)
        weigh = Explainer(premise, short, scale.u, components, end.suspects)
        if end.odd or weigh.asked(fit):
            whole = [one for one in weigh.explain(fit) if one.whole]
            if why := explained(whole, protocol.vocabulary, end.accused):
                reasons = (*(one for one in reasons if one not in end.accused), *why)
    result = DropResult(
        run,
        drop.attempt,
        verdict_of(reasons),
        reasons,
        audit,
        found,
        fit.rods,
        fit.estimate.scatter,
        unmatched=unmatched,
        last_passages=alone,
        gates=budgets.gates(joint.drops[0]),
    )
    return result, fit
