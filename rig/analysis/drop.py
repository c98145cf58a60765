"""Analysis of a single drop, from its edges to its results and verdict."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from rig.analysis.budgets import Budgets
from rig.analysis.chain_records import ChainRecord, chain_records
from rig.analysis.diagnoses import gates_too_low, silent, suspects
from rig.analysis.drop_model import DropModel
from rig.analysis.edge_classes import unmatched_edges
from rig.analysis.explanations import Explainer
from rig.analysis.faults import Premise, Suspects
from rig.analysis.fit import Begun, DropFit, Fit, settle
from rig.analysis.gravity import free_gravity
from rig.analysis.identify import DropIdentity, few_edges, identify, pattern_faults
from rig.analysis.joint_fit import by_itself
from rig.analysis.last_passages import last_passages
from rig.analysis.owners import suffixes
from rig.analysis.result import GOOD, Audit, Deviation, DropResult
from rig.analysis.verdict import is_wrong, judge, judge_record, verdict_of
from rig.clock.calibration import TimeScale
from rig.protocol.contact import of_run
from rig.protocol.protocol import Protocol, Run
from rig.reasons import make_reason
from rig.records import Drop
from rig.threads import one_thread

Readings = dict[tuple[int, ...], DropIdentity]
"""Identifications of a drop's edges, by the numbers of the gates left out."""


@dataclass(frozen=True, slots=True)
class DropSummary:
    """Picklable result of a drop's own analysis, without its equations.

    Attributes
    ----------
    scale
        Time scale of the analysis.
    explained
        Whether set-up faults were searched for if the drop is void.
    identified
        Identification of the edges, by the gates left out; empty for a damaged record.
    aside
        Numbers of the gates left out.
    fitted
        Fitted matches and unknowns; `None` if no fit converged.
    deviations
        `Measured.deviation` of each quantity, as a stored result does not contain these.
    """

    scale: TimeScale
    explained: bool
    result: DropResult
    identified: Mapping[tuple[int, ...], DropIdentity]
    aside: tuple[int, ...]
    fitted: Begun | None
    deviations: Mapping[str, Deviation | None]

    @property
    def needs_explanation(self) -> bool:
        """Whether the drop is void, so that a set-up fault might explain its edges."""
        return self.result.verdict == "void" and not self.result.damaged

    def whole(self) -> DropSummary:
        """Return a stored summary with the deviations put back into its quantities."""
        values = self.result.quantities.items()
        quantities = {name: replace(m, deviation=self.deviations[name]) for name, m in values}
        return replace(self, result=replace(self.result, quantities=quantities))


@dataclass(frozen=True)
class DropCase:
    """A drop to be analysed, with its protocol and time scale.

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
    aside
        Numbers of the gates that are left out, see `rig.analysis.diagnoses.gates_too_low`.
    """

    protocol: Protocol
    run: Run
    drop: Drop
    scale: TimeScale
    aside: tuple[int, ...] = ()

    @one_thread
    def summary(self, before: DropSummary | None = None, *, explain: bool = True) -> DropSummary:
        """Analyse the drop by itself.

        Parameters
        ----------
        before
            Earlier summary at any time scale, to save time. Results are the same without it.
        explain
            As for `read`.
        """
        readings = {} if before is None else {**before.identified}
        result, fit = self.read(readings, explain=explain)
        aside, fitted = self.aside, None
        if fit is not None:
            if result.verdict in GOOD:
                result = replace(result, gravity=free_gravity(fit))
            if fit.estimate.settled:
                records, fitted = fit.model.records.values(), fit.begun
                aside = tuple(gate for record in records for gate in record.aside)
        deviations = {name: value.deviation for name, value in result.quantities.items()}
        return DropSummary(self.scale, explain, result, readings, aside, fitted, deviations)

    @one_thread
    def restore_drop(self, summary: DropSummary) -> DropFit | None:
        """Return the fitted drop of a summary; `None` if its fit did not converge."""
        fitted = summary.fitted
        if fitted is None:
            return None
        case = replace(self._at_contact(), aside=summary.aside)
        model = case._model(fitted.alpha)
        model.owners = suffixes(self.protocol, self.run)
        return DropFit(model, fitted.matches, fitted.x)

    @one_thread
    def read(
        self, readings: Readings | None = None, *, explain: bool = True
    ) -> tuple[DropResult, Fit | None]:
        """Return the drop's result and fit; low gates that not all rods pass may be left out.

        Parameters
        ----------
        readings
            Cache of identifications by the gates left out; updated in place.
        explain
            Whether to search for set-up faults if the drop is void, which takes many times as long
            as the rest. For other drops they are searched for if the fit suggests it.
        """
        drop, readings = self.drop, {} if readings is None else readings
        if drop.damage:  # a damaged file says nothing about chains or gates
            reasons = (make_reason("record_damaged", text=drop.damage),)
            return DropResult(self.run, drop.attempt, "void", reasons, Audit(), damaged=True), None
        case = stated = self._at_contact()
        reading, latest, low = stated._identify(readings), None, stated.aside
        fits: dict[tuple[int, ...], tuple[DropIdentity, Fit | None]] = {}
        while low not in fits:
            case = replace(stated, aside=low)
            reading = reading if latest else case._identify(readings)
            fits[low] = reading, latest = case._settle(reading, latest)
            low = *low, *gates_too_low(self.protocol, case.records, latest)
        if case.aside:
            without = result, _ = case._judge(*fits[case.aside], readings, explain=False)
            if not is_wrong(result.reasons):
                return without
        return stated._judge(*fits[stated.aside], readings, explain=explain)

    def _at_contact(self) -> DropCase:
        return replace(self, protocol=of_run(self.protocol, self.run))

    @cached_property
    def records(self) -> list[ChainRecord]:
        """Each chain with its edges."""
        return chain_records(self.protocol, self.run, self.drop, self.scale.hz, self.aside)

    def _model(self, alpha: float) -> DropModel:
        return DropModel.of(self.protocol, self.records, self.scale.u, alpha)

    def _identify(self, readings: Readings) -> DropIdentity:
        """Return the identification without the gates `aside`, at a rounded time scale."""
        rough, reading = replace(self, scale=self.scale.coarse()), readings.get(self.aside)
        if reading is None or reading.scale != rough.scale:
            earliest = -math.inf if self.drop.fire_tick is None else 0.0
            identification = identify(self.protocol, rough.records, rough.scale.u, earliest)
            unlike = pattern_faults(identification, self.protocol.vocabulary)
            best = None if unlike else identification.drop
            reading = DropIdentity(rough.scale, unlike, best.begun if best else None)
            readings[self.aside] = reading
        return reading

    def _settle(self, reading: DropIdentity, before: Fit | None) -> tuple[DropIdentity, Fit | None]:
        """Return the identification of a drop, and its fit if the edges match a fall."""
        if before is not None:
            return reading, settle(self._model(before.model.alpha), before.x)
        if reading.begun is None:
            return reading, None
        alpha, matches, x = reading.begun
        model, x = self._model(alpha), x.copy()
        clock = model.unknowns["clock"]
        x[clock] = (1.0 + x[clock]) * self.scale.hz / reading.scale.hz - 1.0
        fit = settle(model, x, matches)
        unlike = few_edges(fit.shares, self.protocol.vocabulary)
        return replace(reading, unlike=unlike), None if unlike else fit

    def _judge(
        self, reading: DropIdentity, fit: Fit | None, readings: Readings, *, explain: bool
    ) -> tuple[DropResult, Fit | None]:
        """Return the drop's result and its fit, if that is good enough for values."""
        protocol, run, drop, records = self.protocol, self.run, self.drop, self.records
        audit = _blank_audit(drop, records)
        unlike = {reason.text: reason for reason in reading.unlike.values()}.values()
        doubts = silent(protocol, records) if reading.unlike else ()
        reasons = (*judge_record(drop, audit), *unlike, *doubts)
        verdict = verdict_of(reasons)
        if verdict == "void" or fit is None:
            if reading.unlike and explain:
                if reading.explained is None:
                    named = self._explainer(reading.scale, suspects(records)).name_fault(None)
                    readings[self.aside] = reading = replace(reading, explained=named)
                reasons = (*reasons, *(reading.explained or ()))
            return DropResult(run, drop.attempt, verdict, reasons, audit), None
        unmatched = unmatched_edges(fit)
        audit = audit.count(fit.match_count, unmatched)
        joint = by_itself(fit)
        budgets = Budgets(joint)
        measured = budgets.measure_all(joint.drops[0])
        if not all(
            math.isfinite(number)
            for value in measured.values()
            for number in (value.value, value.u)
        ):
            reasons = (make_reason("no_fall", protocol.vocabulary),)
            return DropResult(run, drop.attempt, "void", reasons, audit), None
        by_passages = last_passages(fit)
        reasons = judge(fit, run, drop, audit, measured, by_passages, unmatched)
        if explain or not is_wrong(reasons):
            explainer = self._explainer(self.scale, suspects(records, fit.matches))
            reasons = explainer.name_fault(fit, reasons)
        result = DropResult(
            run,
            drop.attempt,
            verdict_of(reasons),
            reasons,
            audit,
            measured,
            fit.rods_of(len(drop.edges)),
            fit.estimate.scatter,
            unmatched=unmatched,
            last_passages=by_passages,
            gates=budgets.gates(joint.drops[0]),
        )
        return result, fit

    def _explainer(self, scale: TimeScale, suspects: Suspects) -> Explainer:
        premise = Premise(self.protocol, self.run, scale.hz, self.aside)
        return Explainer(premise, self.drop, scale.u, suspects)


def _blank_audit(drop: Drop, records: Sequence[ChainRecord]) -> Audit:
    """Return the edge counts of a drop before any edge is matched."""
    left_out = sum(record.thinned for record in records)
    seen = sum(record.edges.times.size for record in records)
    expected = sum(record.edge_count for record in records)
    lost = 0 if drop.certificate is None else drop.certificate.overflows
    return Audit(seen + left_out, 0, expected, seen + left_out, lost, seen, left_out)
