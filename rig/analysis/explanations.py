"""Search for the set-up fault that explains a drop, by comparison of marginal likelihoods.

If a drop cannot be identified, or fits badly, its set-up may have a single fault. A fault with a
continuous size (longer chain, another drop height, higher post, slow clock …) is a direction of the
unknowns: a score test selects candidates, and the size is fitted with all other unknowns. Any other
fault (exchanged gates, wrong number of rods …) is another protocol, with which the edges are
identified anew. Both compete by marginal likelihood with the stated protocol. Each fault has a
prior probability and a range of sizes. The rivals of a fault are all others, and a fall that
departs from the equations. Only a fault with clear odds against all rivals is named.
"""

import math
from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

from rig.analysis.annealing import LEAST, PEAKS, Pairing
from rig.analysis.chain_records import ChainRecord, chain_records, thin
from rig.analysis.faults import Fault, Premise, Suspects, faults
from rig.analysis.fit import Fit, settle
from rig.analysis.identify import identify, side_fall, well_read
from rig.analysis.last_passages import APART
from rig.analysis.score_test import scores
from rig.analysis.unknowns import prior_air
from rig.analysis.verdict import is_wrong
from rig.arrays import Array
from rig.protocol.protocol import Protocol
from rig.reasons import Reason, make_reason
from rig.records import Drop

CLEAR = math.log(100.0)
"""Least log odds of a named fault against every rival and the stated protocol. Also the cost of a
fault's prior probability: 1 drop in 100 has a given fault."""
_NAMED = 3  # faults listed if none is clear, and moments of a brake that are fitted
_DEPARTURES = "stretch", "landed", "bounce"
_BEYOND = 10.0  # factor on the scale of a departure, in a fall that departs from the equations


_EVIDENCE = attrgetter("evidence")
_NEITHER = Fault("", lambda stated, _: stated)
"""Rival hypothesis: no fault, in a fall by the equations or in one that departs from them."""
_ACCUSING = {
    *("gate_disagrees", "gate_disagrees_few", "gate_off", "air", "air_accelerates"),
    "other_incline",
}
"""Reasons that blame gates, air or surface; a fault that is named takes their place."""


class Explanation(NamedTuple):
    """A fault that would explain a drop.

    Attributes
    ----------
    fault
        The fault.
    values
        Values of the reason that names it.
    evidence
        Log marginal likelihood with the fault, less the cost of its prior probability.
    whole
        Whether it explains nearly all edges.
    """

    fault: Fault
    values: Mapping[str, Any]
    evidence: float
    whole: bool = True


@dataclass(frozen=True)
class Explainer:
    """Compares the possible set-up faults of a drop.

    Attributes
    ----------
    stated
        Premise as stated.
    drop
        The raw record.
    clock_u
        Relative standard uncertainty of the time scale.
    suspects
        Gates and rods that the edges cast doubt on.
    """

    stated: Premise
    drop: Drop
    clock_u: float
    suspects: Suspects
    _votes: dict[Hashable, int] = field(default_factory=dict)
    """Cache of a side's votes: a fault of a side does not change those of the other."""

    @cached_property
    def _thinned(self) -> Drop:
        return thin(self.drop, self.stated.hz)

    @cached_property
    def _faults(self) -> tuple[list[Fault], list[Fault]]:
        """Faults of a continuous size, and all others."""
        kinds: tuple[list[Fault], list[Fault]] = [], []
        for fault in faults(self.stated, self.suspects):
            kinds[not fault.continuous].append(fault)
        return kinds

    def name_fault(self, fit: Fit | None, reasons: Sequence[Reason] = ()) -> tuple[Reason, ...]:
        """Return reasons with the one that names the clear fault, or lists the likeliest.

        Parameters
        ----------
        fit
            Fit with the stated protocol; `None` if the drop was not identified.
        reasons
            Reasons about the drop; those that accuse gates, air or surface give way to the fault.
        """
        if fit is not None and not self._is_odd(fit, reasons):
            return (*reasons,)
        causes = [cause for cause in self._explain(fit) if cause.whole or fit is None]
        # A fault found by score and by votes counts once.
        ranked = [*{cause.fault.kin: cause for cause in sorted(causes, key=_EVIDENCE)}.values()]
        ranked.sort(key=_EVIDENCE, reverse=True)
        neither = next(cause.evidence for cause in ranked if cause.fault is _NEITHER)
        if ranked[0].fault is _NEITHER or ranked[0].evidence < neither + CLEAR:
            return (*reasons,)
        best, rival, *_ = ranked
        words, lead = self.stated.protocol.vocabulary, best.evidence - rival.evidence
        if best.whole and lead > CLEAR:
            why = make_reason(best.fault.code, words, **best.values, log_odds=lead)
        else:
            likely = [cause for cause in ranked if cause.evidence > neither][:_NAMED]
            candidates = [{"code": cause.fault.code, "values": cause.values} for cause in likely]
            why = make_reason("unclear_fault", words, candidates=candidates)
        return (*(reason for reason in reasons if reason.code not in _ACCUSING), why)

    def _is_odd(self, fit: Fit, reasons: Sequence[Reason]) -> bool:
        """Whether a fault is searched for, which takes longer than all the rest."""
        return (
            any(reason.code in _ACCUSING for reason in reasons)
            or is_wrong(reasons)
            or not well_read(fit)
            or any(self.suspects.rods.values())
            or self.suspects.more
            or self._suggests_fault(fit, self.stated)
        )

    def _suggests_fault(self, fit: Fit, premise: Premise, named: Fault = _NEITHER) -> bool:
        """Whether the score test of a fitted drop favours a fault beyond those of its premise."""
        others = [fault for fault in self._faults[0] if fault.kin != named.kin]
        return bool((self._score_odds(fit, premise, others) > CLEAR).any())

    def _explain(self, fit: Fit | None) -> Iterator[Explanation]:
        """Yield faults that may explain the drop, and the hypothesis that there is none."""
        sized, discrete = self._faults
        if fit is None:
            records = self._records(self.stated)
            yield Explanation(_NEITHER, {}, sum(map(self._read_alone, records)))
            # Too few edges for any fall would only fit a chain with fewer rods.
            if all(Pairing(side).matchable >= LEAST * side.edge_count for side in records):
                yield from self._by_votes([*sized, *discrete])
            return
        stated = Explanation(_NEITHER, {}, self._evidence(fit, self.stated.hz))
        causes = [stated, *self._along(fit), *self._by_votes(discrete)]
        best = max(causes, key=_EVIDENCE)
        if not (best.whole and best.fault.continuous) and (
            best is not stated or not well_read(fit)
        ):
            # A chain with a surplus rod looks like another drop height. A score test that starts a
            # rod's distance away cannot see that.
            causes += self._by_votes(sized)
        yield from causes
        clear = [cause.whole and cause.evidence > stated.evidence + CLEAR for cause in causes]
        if any(clear) and "stretch" in fit.model.unknowns:
            # The fall may depart from the equations, without a fault.
            scales = fit.model.components
            for name in _DEPARTURES:
                wider = replace(scales, **{name: _BEYOND * getattr(scales, name)})
                beyond = settle(fit.model.copy_with(components=wider), fit.x)
                yield Explanation(_NEITHER, {}, self._evidence(beyond, self.stated.hz) - CLEAR)

    def _read_alone(self, record: ChainRecord) -> float:
        """Return the evidence of a side by itself, for a drop that was not identified."""
        reading = self._read(self.stated.protocol, [record])
        none = float(np.sum(np.log(record.due.absent)))
        return none if reading is None else self._evidence(reading, self.stated.hz)

    def _read(self, protocol: Protocol, records: Sequence[ChainRecord]) -> Fit | None:
        """Return the best reading near the stated values; quicker than all of `identify`."""
        return identify(protocol, records, self.clock_u, batches=1).fit_reading()

    def _along(self, fit: Fit) -> Iterator[Explanation]:
        """Yield fits of the continuous faults with the largest gain by the score test."""
        sized, _ = self._faults
        gains = self._score_odds(fit, self.stated, sized)
        # For a good reading the score test excludes faults without gain. A fault may also remove
        # the penalty for negative drag.
        least = min(0.0, fit.held_back) if well_read(fit) else -math.inf
        likely: dict[object, Fault] = {}
        for n in np.argsort(-gains).tolist():
            if gains[n] > least:
                likely.setdefault(sized[n].kin, sized[n])
        for alike in [fault.alike for fault in likely.values()][:PEAKS]:
            odds = self._score_odds(fit, self.stated, alike)
            for n in np.argsort(-odds)[:_NAMED].tolist():
                yield from self._fit_size(alike[n], 0.0, fit)

    def _score_odds(self, fit: Fit, premise: Premise, faults: Sequence[Fault]) -> Array:
        """Return the log odds of continuous faults by their score, without their prior's cost."""
        # Directions from the stated protocol are the same for all drops of a condition.
        is_stated = premise is self.stated and not fit.model.suspects
        known, vectors = fit.model.directions if is_stated else {}, []
        for fault in faults:
            key = fault.code, repr(fault.where)
            if key not in known:
                known[key] = fault.direction(premise, fit.model)
            vectors.append(known[key])
        test = scores(fit, vectors, [fault.braked(fit) for fault in faults])
        # The Occam factor: ln of the prior range of a size over its posterior width.
        widths = math.sqrt(2.0 * math.pi) * test.u
        ranges = [(min(fault.sizes), max(fault.sizes), fault.cost(fit)) for fault in faults]
        least, largest, cost = np.array(ranges).T
        odds = test.gain - np.log(np.maximum(1.0, (largest - least) / widths)) - cost
        return np.where((least == 0.0) & (test.size < 0.0), -np.inf, odds)

    def _evidence(self, fit: Fit, hz: float) -> float:
        """Return the evidence of a reading, comparable between premises.

        Two corrections apply: the density of times is converted to ticks, and the reference of
        all rods missed depends on the number of expected rods. A rod missed at a gate counts once,
        not for both edges. Otherwise a rod at an end that no gate saw by chance would count as
        absent.
        """
        records, matches = fit.model.records.values(), fit.matches
        ticks = len(self._thinned.edges) * math.log(self.stated.hz / hz)
        missed = 0.0
        for record in records:
            due, seen = record.due, matches[record.role] >= 0
            rods = due.gate * record.chain.chain.rods + due.rods
            hidden = due.blocks & ~np.isin(rods, rods[seen])
            missed += float(np.log(due.absent[hidden]).sum())
        return fit.evidence + ticks + missed

    def _records(self, premise: Premise) -> list[ChainRecord]:
        return chain_records(
            premise.protocol, premise.run, self._thinned, premise.hz, premise.aside
        )

    def _by_votes(self, faults: Sequence[Fault]) -> Iterator[Explanation]:
        """Yield fits of the faults with most votes, each at its best size; best first."""
        least = self._net(self.stated)[1]
        candidates = []
        for fault in (fault for fault in faults if not fault.power):  # a brake changes no premise
            sized = [
                (*self._net(fault.change(self.stated, size), least), size) for size in fault.sizes
            ]
            share, net, size = max(sized, key=lambda row: row[1])
            if share >= LEAST and net >= least:
                candidates.append((net, fault, size))
        candidates.sort(key=lambda row: -row[0])
        for _, fault, size in candidates[:PEAKS]:
            yield from self._afresh(fault, size)

    def _net(self, premise: Premise, least: float = -math.inf) -> tuple[float, int]:
        """Return the voting share of the expected edges, and votes less edges without a vote.

        Both are upper bounds if the second cannot reach `least`.
        """
        records, protocol = self._records(premise), premise.protocol
        scene = premise.hz, protocol.drop.value, protocol.gravity.value, prior_air(protocol)[0]
        expected = sum(side.edge_count for side in records)
        votes = [Pairing(record).matchable for record in records]
        for n, record in enumerate(records):
            if 2 * sum(votes) - expected < least:
                break
            edges = record.edges.gate, record.edges.number, *record.due
            key = record.role, *scene, *(part.tobytes() for part in edges)
            if key not in self._votes:
                # Many edges of a flicker vote for the same rod.
                most = side_fall(protocol, record, self.clock_u).most_votes()
                self._votes[key] = min(most, votes[n])
            votes[n] = self._votes[key]
        return sum(votes) / max(1, expected), 2 * sum(votes) - expected

    def _afresh(self, fault: Fault, size: float) -> Iterator[Explanation]:
        """Identify the edges anew with a fault of some size, and yield it with its evidence."""
        premise = fault.change(self.stated, size)
        fit = self._read(premise.protocol, self._records(premise))
        if fit is None:
            return
        u, occam = 0.0, math.log(fault.ways or len(fault.sizes))
        if fault.continuous:
            yield from self._fit_size(fault, size, fit)
            return
        if fault.code == "air":
            # κ was integrated out like all other unknowns.
            size = fit.model.kappa(fit.x)
            u = float(fit.estimate.own_u[fit.model.unknowns["drag"]][0])
        yield self._explanation(fault, fault.values(size, u), fit, premise, occam)

    def _fit_size(self, fault: Fault, size: float, fit: Fit) -> Iterator[Explanation]:
        """Fit a drop with the size of a fault as a further unknown; yield nothing if unclear.

        Parameters
        ----------
        size
            Size of the fault in the model of `fit`.
        fit
            Fit to begin with.
        """
        premise, brake = fault.change(self.stated, size), fault.braked(fit)
        direction, sizes = fault.direction(premise, fit.model), fault.sizes
        score = scores(fit, [direction], [brake])
        model = fit.model.copy_with(suspects=(fault.suspect(fit.model, direction, brake),))
        first = np.clip(score.size, min(sizes), max(sizes)) * np.append(score.follow, 1.0)
        sized = settle(model, np.append(fit.x, 0.0) + first)
        estimate = sized.estimate
        further, u = float(estimate.x[-1]), float(estimate.own_u[-1])
        if APART * u < abs(size + further) and min(sizes) <= size + further <= max(sizes):
            # A smaller size may be zero, a larger size has another cause.
            premise = premise._replace(hz=premise.hz / (1.0 + model.unknowns.rate[-1] * further))
            values = fault.values(size + further, u) | ({"time_s": brake.time_s} if brake else {})
            yield self._explanation(fault, values, sized, premise, fault.cost(fit))

    def _explanation(
        self,
        fault: Fault,
        values: Mapping[str, Any],
        fit: Fit,
        premise: Premise,
        occam: float = 0.0,
    ) -> Explanation:
        evidence = self._evidence(fit, premise.hz) - CLEAR - occam
        complete = well_read(fit) and not self._suggests_fault(fit, premise, fault)
        return Explanation(fault, values, evidence, complete)
