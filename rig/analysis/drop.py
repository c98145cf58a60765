"""One drop, from its edges to its results."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.analysis.budgets import Budgets
from rig.analysis.chain_records import chain_records, thinned
from rig.analysis.components import stated
from rig.analysis.diagnoses import FEW_GATES, gates_too_low, silent
from rig.analysis.drop_model import DropModel
from rig.analysis.edge_classes import count_unexplained, unmatched_edges
from rig.analysis.explanations import Explainer, name_fault
from rig.analysis.faults import Premise
from rig.analysis.fit import Matched, timed
from rig.analysis.gravity import free_gravity
from rig.analysis.identify import identify_drop
from rig.analysis.joint_fit import by_itself
from rig.analysis.last_passages import last_passages
from rig.analysis.result import GOOD, Audit, DropResult
from rig.analysis.verdict import judge, judge_record, verdict_of
from rig.protocol.contact import at_contact
from rig.reasons import make_reason
from rig.threads import one_thread
from rig.wordings import Severity

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rig.analysis.chain_records import ChainRecord
    from rig.analysis.components import Components
    from rig.analysis.fit import Begun, Fit
    from rig.analysis.identify import DropIdentity
    from rig.analysis.result import Deviation
    from rig.arrays import Array
    from rig.clock.calibration import TimeScale
    from rig.protocol.protocol import Protocol, Run
    from rig.reasons import Reason
    from rig.records import Drop


_SKEW = {"release_skew"}  # no way to pass makes that better


@dataclass(frozen=True, slots=True)
class DropSummary:
    """What a drop says by itself, without its equations: to be kept, or sent to another process.

    Attributes
    ----------
    scale
        At which.
    explained
        Whether it was sought what else would explain it if it is void.
    identified
        Which rods its edges are, by the gates that are left out; nothing of a damaged record.
    aside
        Which are; `None` where no fit came to an end.
    x
        The unknowns, as they were adjusted; shape ``(unknowns,)``.
    deviations
        Those of the result's quantities, which are not kept with them.
    """

    scale: TimeScale
    explained: bool
    result: DropResult
    identified: Mapping[tuple[int, ...], DropIdentity]
    aside: tuple[int, ...] | None
    x: Array
    deviations: Mapping[str, Deviation | None]

    @property
    def unexplained(self) -> bool:
        """Whether something else than the protocol might explain it, if it were sought."""
        return self.result.verdict == "void" and not self.result.damaged

    def whole(self) -> DropSummary:
        """Return what was kept with its deviations in their places."""
        values = self.result.quantities.items()
        quantities = {name: replace(m, deviation=self.deviations[name]) for name, m in values}
        return replace(self, result=replace(self.result, quantities=quantities))


class DropCase(NamedTuple):
    """A drop to be read.

    Attributes
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
    aside
        Numbers of the gates that are left out, see `rig.analysis.diagnoses.gates_too_low`.
    """

    protocol: Protocol
    run: Run
    drop: Drop
    scale: TimeScale
    components: Components | None = None
    aside: tuple[int, ...] = ()

    @one_thread
    def summary(self, before: DropSummary | None = None, *, explain: bool = True) -> DropSummary:
        """Find out what the drop says by itself.

        Parameters
        ----------
        before
            What was found of it at any time scale. Results are the same without it.
        explain
            As for `read`.
        """
        readings = {} if before is None else {**before.identified}
        result, fit = self.read(readings, explain=explain)
        aside, x = None, np.zeros(0)
        if fit is not None:
            if result.verdict in GOOD:
                result = replace(result, gravity=free_gravity(fit))
            if fit.estimate.settled:
                records, x = fit.model.records.values(), fit.x
                aside = tuple(train.gate for record in records for train in record.aside)
        deviations = {name: value.deviation for name, value in result.quantities.items()}
        return DropSummary(self.scale, explain, result, readings, aside, x, deviations)

    @one_thread
    def adjusted(self, summary: DropSummary) -> Matched | None:
        """Return where a summary left the drop; `None` where no fit of it came to an end."""
        aside = summary.aside
        if aside is None:
            return None
        case = self._at_contact()._replace(aside=aside)
        begun = summary.identified[aside].begun
        assert begun is not None
        return Matched(case._model(case._records(), begun), begun.matches, summary.x)

    @one_thread
    def read(
        self, readings: dict[tuple[int, ...], DropIdentity] | None = None, *, explain: bool = True
    ) -> tuple[DropResult, Fit | None]:
        """Read the drop, without the low gates that not all rods pass.

        Parameters
        ----------
        readings
            What its edges are where some gates are left out, as far as it is known, and will be.
        explain
            Whether to seek what else than the protocol would explain a drop that is void as it is:
            it takes many times as long as all the rest. Of others it is sought where they ask.
        """
        drop, readings = self.drop, {} if readings is None else readings
        if drop.damage:  # the file's, and no finding about chains or gates
            reasons = (make_reason("record_damaged", text=drop.damage),)
            return DropResult(self.run, drop.attempt, "void", reasons, Audit(), damaged=True), None
        stated = self._at_contact()
        result, fit = stated._read(readings, explain=False)
        wrong = _void_by(result) - _SKEW
        case, last = stated, fit
        while low := gates_too_low(
            self.protocol, last.model.records.values() if last else case._records(), last
        ):
            before = readings[case.aside].begun
            case = case._replace(aside=(*case.aside, *low))
            without = reading, last = case._read(readings, before, explain=False)
            if not _void_by(reading) - _SKEW:
                return without
        return stated._read(readings, explain=True) if wrong and explain else (result, fit)

    def _at_contact(self) -> DropCase:
        run, protocol = self.run, self.protocol
        components = self.components or stated(protocol)
        protocol = at_contact(protocol, run.incline_deg, run.impact)
        return self._replace(protocol=protocol, components=components)

    def _records(self) -> list[ChainRecord]:
        return chain_records(self.protocol, self.run, self.drop, self.scale.hz, self.aside)

    def _model(self, records: Sequence[ChainRecord], begun: Begun) -> DropModel:
        return DropModel.of(self.protocol, records, begun.guesses, self.scale.u, self.components)

    def _read(
        self,
        readings: dict[tuple[int, ...], DropIdentity],
        before: Begun | None = None,
        *,
        explain: bool,
    ) -> tuple[DropResult, Fit | None]:
        """Read a drop whose rods strike where the protocol, from the contact point, has them."""
        protocol, run, drop, scale, components, aside = self
        assert components is not None
        records = self._records()
        audit = _blank_audit(drop, records)
        rough, reading = scale.coarse(), readings.get(aside)
        if reading is None or reading.scale != rough:
            reading = identify_drop(protocol, run, drop, rough, components, aside, before)
            readings[aside] = reading
        unlike = {reason.text: reason for reason in reading.unlike.values()}.values()
        doubts = silent(protocol, records) if reading.unlike else ()
        reasons = (*judge_record(drop, audit), *unlike, *doubts)
        verdict = verdict_of(reasons)
        if verdict == "void" or reading.begun is None:
            if reading.unlike and explain:
                if reading.explained is None:
                    reading = replace(reading, explained=self._unlike_fall(reading, rough))
                    readings[aside] = reading
                reasons = (*reasons, *(reading.explained or ()))
            return DropResult(run, drop.attempt, verdict, reasons, audit), None
        begun = reading.begun
        fit = timed(self._model(records, begun), begun, scale.hz / reading.scale.hz)
        unmatched = unmatched_edges(fit)
        audit = audit.count(fit.matched, count_unexplained(unmatched))
        joint = by_itself(fit)
        budgets = Budgets(joint)
        measured = budgets.measured(joint.drops[0])
        if not all(
            math.isfinite(number)
            for value in measured.values()
            for number in (value.value, value.u)
        ):
            reasons = (make_reason("no_fall", protocol.vocabulary),)
            return DropResult(run, drop.attempt, "void", reasons, audit), None
        by_passages = last_passages(fit)
        end = judge(protocol, run, drop, audit, measured, fit, by_passages, unmatched)
        reasons = end.reasons
        if not end.known and (explain or verdict_of(end.reasons) != "void"):
            explainer = self._explainer(scale, end.suspects)
            if end.odd or explainer.asked(fit):
                causes = [cause for cause in explainer.explain(fit) if cause.whole]
                if why := name_fault(causes, protocol.vocabulary, end.accused):
                    reasons = (*(one for one in reasons if one not in end.accused), *why)
        result = DropResult(
            run,
            drop.attempt,
            verdict_of(reasons),
            reasons,
            audit,
            measured,
            fit.rods,
            fit.estimate.scatter,
            unmatched=unmatched,
            last_passages=by_passages,
            gates=budgets.gates(joint.drops[0]),
        )
        return result, fit

    def _unlike_fall(self, reading: DropIdentity, scale: TimeScale) -> tuple[Reason, ...]:
        """Seek what else than the protocol would explain edges that are like no fall."""
        assert self.protocol.gates is not None
        gates = self.protocol.gates.gates
        strange = [n for n, gate in enumerate(gates) if gate.side in reading.poor]
        if not strange and len(gates) <= FEW_GATES:
            strange = [*range(len(gates))]  # each may see nearly what another should
        causes = self._explainer(scale, strange).explain(None)
        return tuple(name_fault(causes, self.protocol.vocabulary))

    def _explainer(self, scale: TimeScale, suspects: Sequence[int]) -> Explainer:
        assert self.components is not None
        premise = Premise(self.protocol, self.run, scale.hz, self.aside)
        return Explainer(premise, thinned(self.drop, scale.hz), scale.u, self.components, suspects)


def _void_by(result: DropResult) -> set[str]:
    """Return the codes of the reasons for which a drop is void."""
    return {reason.code for reason in result.reasons if reason.severity is Severity.VOID}


def _blank_audit(drop: Drop, records: Sequence[ChainRecord]) -> Audit:
    """Count the edges of a drop of which none is any rod's yet."""
    trains = [part for record in records for part in (*record.trains, *record.aside)]
    left_out = sum(part.thinned for part in trains)
    seen = sum(part.times.size for part in trains)
    expected = sum(record.expected for record in records)
    lost = 0 if drop.certificate is None else drop.certificate.overflows
    return Audit(seen + left_out, 0, expected, seen + left_out, lost, seen, left_out)
