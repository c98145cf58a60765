"""Search for the set-up fault that explains a drop, by comparison of marginal likelihoods.

If a drop cannot be identified, or fits badly, its set-up may have a single fault. A fault with a
size (longer chain, another drop height, higher post, slow clock …) is a direction of the unknowns:
a score test selects candidates, and the size is fitted with all other unknowns. A fault without a
size (exchanged gates, wrong number of rods …) is another protocol, with which the edges are
identified anew. Both compete by marginal likelihood with the stated protocol. Each fault has a
prior probability and a range of sizes. The rivals of a fault are all others, and a fall that
departs from the equations. Only a fault with clear odds against all rivals is named.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from rig.analysis.annealing import LEAST, MISSED
from rig.analysis.chain_records import ChainRecord, chain_records
from rig.analysis.components import Components
from rig.analysis.diagnoses import RIGHT
from rig.analysis.faults import Fault, Premise, faults
from rig.analysis.fit import Fit, settle
from rig.analysis.identify import (
    Reading,
    held_back,
    most_votes,
    possible,
    read_quickly,
    weigh,
    well_read,
)
from rig.analysis.last_passages import APART
from rig.analysis.score_test import scores
from rig.analysis.unknowns import prior_air
from rig.arrays import Array
from rig.reasons import Reason, make_reason
from rig.records import Drop
from rig.vocabulary import Vocabulary

CLEAR = math.log(100.0)
"""Least log odds of a named fault against every rival and the stated protocol. Also the cost of a
fault's prior probability: 1 drop in 100 has a given fault."""
_NAMED = 3  # faults listed if none is clear
_TRIED = 4  # faults that are fitted: those with the most votes
_BEYOND = 10.0  # factor on the prior of the stretch, in a fall that departs from the equations
_LEFT = 12.5  # largest gain of a further fault if a fault explains the drop: 5 σ


NEITHER = Fault("")
"""Rival hypothesis: no fault, but a fall that departs from the equations."""


class Explanation(NamedTuple):
    """A fault that would explain a drop.

    Attributes
    ----------
    fault
        The fault.
    values
        Values of the reason that names it.
    log_odds
        Log odds against the stated protocol.
    whole
        Whether it explains nearly all edges.
    """

    fault: Fault
    values: dict[str, Any]
    log_odds: float
    whole: bool


@dataclass(frozen=True)
class Explainer:
    """Compares the possible set-up faults of a drop.

    Attributes
    ----------
    setting
        Premise as stated.
    drop
        The raw record.
    clock_u
        Relative standard uncertainty of the time scale.
    components
        Variance components.
    suspects
        Numbers of the gates of which any two may be exchanged.
    """

    setting: Premise
    drop: Drop
    clock_u: float
    components: Components
    suspects: Sequence[int]
    _votes: dict[Hashable, int] = field(default_factory=dict)
    """Cache of a side's votes: a fault of a side does not change those of the other."""

    @cached_property
    def _faults(self) -> tuple[list[Fault], list[Fault]]:
        """Faults with a size that is fitted, and faults without."""
        kinds: tuple[list[Fault], list[Fault]] = [], []
        for fault in faults(self.setting.protocol, self.setting.run, self.suspects):
            kinds[fault.shift is None].append(fault)
        return kinds

    def suggests_fault(self, fit: Fit) -> bool:
        """Whether the score test of a fitted drop favours a fault."""
        return bool((self._gains(fit)[0] > CLEAR).any())

    def explain(self, fit: Fit | None) -> list[Explanation]:
        """Return the faults that are likelier than none, the likeliest first.

        Parameters
        ----------
        fit
            Fit with the stated protocol; `None` if the drop was not identified.
        """
        sized, discrete = self._faults
        if fit is None:
            records = self._records(self.setting)
            if any(possible(record) < LEAST * record.edge_count for record in records):
                return []  # too few edges for any fall
            stated = sum(self._read_alone(record) for record in records)
            explanations = [*self._by_votes([*sized, *discrete], stated)]
        else:
            reading = weigh(fit)
            stated, well = self._absolute(reading, self.setting.hz), well_read(reading)
            explanations = [*self._along(fit, stated, well), *self._by_votes(discrete, stated)]
            likelier = [cause for cause in explanations if cause.log_odds > 0.0]
            likeliest = max(likelier, key=_log_odds, default=None)
            explained = likeliest and likeliest.whole and likeliest.fault.shift
            if not explained and (likelier or not well):
                # A chain with a surplus rod looks like another drop height. A score test that
                # starts a rod's distance away cannot see that.
                explanations += self._by_votes(sized, stated)
            if any(cause.whole and cause.log_odds > CLEAR for cause in explanations):
                explanations += self._beyond(fit, stated)
        # A fault found by score and by votes counts once.
        best = {id(cause.fault): cause for cause in sorted(explanations, key=_log_odds)}
        likely = [cause for cause in best.values() if cause.log_odds > 0.0]
        return sorted(likely, key=_log_odds, reverse=True)

    def _read_alone(self, record: ChainRecord) -> float:
        """Return the evidence of a side by itself, for a drop that was not identified."""
        reading = read_quickly(self.setting.protocol, [record], self.clock_u, self.components)
        if reading is None:
            return record.edge_count * math.log(MISSED)
        return self._absolute(reading, self.setting.hz)

    def _along(self, fit: Fit, stated: float, well: bool) -> Iterator[Explanation]:
        """Yield fits of the sized faults with the largest gain by the score test."""
        gains, _ = self._gains(fit)
        # For a good reading the score test excludes faults without gain. A fault may also remove
        # the penalty for negative drag.
        least = min(0.0, held_back(fit)) if well else -math.inf
        for n in [int(n) for n in np.argsort(-gains) if gains[n] > least][:_TRIED]:
            yield from self._fit_size(self._faults[0][n], 0.0, fit, stated)

    def _beyond(self, fit: Fit, stated: float) -> Iterator[Explanation]:
        """Yield the rival hypothesis that the fall departs from the equations, without a fault."""
        if "stretch" not in fit.model.unknowns:
            return
        scales = self.components
        wider = replace(scales, stretch=_BEYOND * scales.stretch, landed=_BEYOND * scales.landed)
        reading = weigh(settle(fit.model.copy_with(components=wider), fit.x.copy()))
        log_odds = self._absolute(reading, self.setting.hz) - CLEAR - stated
        yield Explanation(NEITHER, {}, log_odds, whole=True)

    def _absolute(self, reading: Reading, hz: float) -> float:
        """Return the evidence of a reading, comparable between premises.

        Two corrections apply: the density of times is converted to ticks, and the reference of
        all rods missed depends on the number of expected rods. A rod missed at a gate counts once,
        not for both edges. Otherwise a rod at an end that no gate saw by chance would count as
        absent.
        """
        fit, ticks = reading.fit, len(self.drop.edges) * math.log(self.setting.hz / hz)
        missed = sum(
            train.rods.size - np.setdiff1d(train.rods, train.rods[match >= 0]).size
            for role, record in fit.model.records.items()
            for train, _, match in record.by_gate(fit.matches[role])
        )
        return reading.evidence + ticks + missed * math.log(MISSED)

    def _gains(self, fit: Fit) -> tuple[Array, float]:
        """Return the log odds of each sized fault by its score, without the cost of its prior.

        In addition the largest gain of any.
        """
        sized, _ = self._faults
        by_fault = scores(fit, [fault.shift.direction(fit.model) for fault in sized if fault.shift])
        # The Occam factor: ln of the prior range of a size over its posterior width.
        ranges = [max(fault.sizes) - min(fault.sizes) for fault in sized]
        widths = [math.sqrt(2.0 * math.pi) * score.u for score in by_fault]
        occam = [math.log(max(1.0, a / b)) for a, b in zip(ranges, widths, strict=True)]
        gains = np.array([score.gain for score in by_fault])
        return gains - np.array(occam), float(gains.max(initial=0.0))

    def _records(self, setting: Premise) -> list[ChainRecord]:
        return chain_records(setting.protocol, setting.run, self.drop, setting.hz, setting.aside)

    def _by_votes(self, faults: Sequence[Fault], stated: float) -> Iterator[Explanation]:
        """Yield fits of the faults with most votes, each at its best size; best first."""
        least = self._net(self.setting)[1]
        candidates = []
        for fault in faults:
            sized = [
                (*self._net(fault.premise(self.setting, size), least), size) for size in fault.sizes
            ]
            share, net, size = max(sized, key=lambda row: row[1])
            if share >= RIGHT and net >= least:
                candidates.append((net, fault, size))
        candidates.sort(key=lambda row: -row[0])
        for _, fault, size in candidates[:_TRIED]:
            yield from self._afresh(fault, size, stated)

    def _net(self, setting: Premise, least: float = -math.inf) -> tuple[float, int]:
        """Return the voting share of the expected edges, and votes less edges without a vote.

        Both are upper bounds if the second cannot reach `least`.
        """
        records = self._records(setting)
        expected = sum(side.edge_count for side in records)
        most = [possible(record) for record in records]
        votes = sum(most)
        for n, record in enumerate(records):
            if 2 * votes - expected < least:
                break
            key = expected, *_key(setting, record)
            if key not in self._votes:
                self._votes[key] = most_votes(
                    setting.protocol, record, self.clock_u, self.components
                )
            votes += self._votes[key] - most[n]
        return votes / max(1, expected), 2 * votes - expected

    def _afresh(self, fault: Fault, size: float, stated: float) -> Iterator[Explanation]:
        """Identify the edges anew with a fault of some size, and yield it with its evidence."""
        premise = fault.premise(self.setting, size)
        reading = read_quickly(
            premise.protocol, self._records(premise), self.clock_u, self.components
        )
        if reading is None:
            return
        if fault.shift is not None:
            yield from self._fit_size(fault, size, reading.fit, stated)
            return
        u, occam = 0.0, math.log(len(fault.sizes))
        if fault.of_air:
            # κ was integrated out like all other unknowns.
            fit, occam = reading.fit, 0.0
            size = fit.model.kappa(fit.x)
            u = float(fit.estimate.own_u[fit.model.unknowns["drag"]][0])
        yield self._explanation(fault, size, u, reading, premise.hz, stated + occam)

    def _fit_size(
        self, fault: Fault, size: float, fit: Fit, stated: float
    ) -> Iterator[Explanation]:
        """Fit a drop with the size of a fault as a further unknown; yield nothing if unclear.

        Parameters
        ----------
        size
            Size of the fault in the model of `fit`.
        fit
            Fit to begin with.
        """
        assert fault.shift is not None
        (score,) = scores(fit, [fault.shift.direction(fit.model)])
        largest, model = max(fault.sizes), fit.model.copy_with(suspects=(fault.suspect(fit.model),))
        first = float(np.clip(score.size, -largest, largest)) * np.append(score.follow, 1.0)
        reading = weigh(settle(model, np.append(fit.x, 0.0) + first))
        estimate = reading.fit.estimate
        further, u = float(estimate.x[-1]), float(estimate.own_u[-1])
        if APART * u < abs(size + further) <= largest:
            # A smaller size may be zero, a larger size has another cause.
            hz = fault.premise(self.setting, size).hz / (1.0 + model.unknowns.rate[-1] * further)
            yield self._explanation(fault, size + further, u, reading, hz, stated)

    def _explanation(
        self, fault: Fault, size: float, u: float, reading: Reading, hz: float, stated: float
    ) -> Explanation:
        log_odds = self._absolute(reading, hz) - CLEAR - stated
        complete = well_read(reading) and self._gains(reading.fit)[1] < _LEFT
        return Explanation(fault, fault.values(size, u), log_odds, complete)


def _log_odds(cause: Explanation) -> float:
    return cause.log_odds


def _key(setting: Premise, record: ChainRecord) -> tuple[Hashable, ...]:
    """Return the cache key of a side's votes."""
    protocol = setting.protocol
    scene = setting.hz, protocol.drop.value, protocol.gravity.value, prior_air(protocol)[0]
    edges = [part.tobytes() for train in record.trains for part in (train.levels, train.edge)]
    return record.role, *scene, *edges


def name_fault(
    causes: Sequence[Explanation], words: Vocabulary, accused: Sequence[Reason] = ()
) -> list[Reason]:
    """Return the reason that names the clear fault of a drop, or lists the likeliest.

    Parameters
    ----------
    words
        Vocabulary of the scene.
    accused
        Reasons to return if there is no fault.
    """
    if not causes or causes[0].log_odds < CLEAR or causes[0].fault is NEITHER:
        return [*accused]
    best, *rivals = causes
    lead = best.log_odds - max([0.0, *(cause.log_odds for cause in rivals)])
    if best.whole and lead > CLEAR:
        return [make_reason(best.fault.code, words, **best.values, log_odds=lead)]
    nameable = [cause for cause in causes if cause.fault is not NEITHER]
    candidates = [{"code": cause.fault.code, "values": cause.values} for cause in nameable[:_NAMED]]
    return [make_reason("unclear_fault", words, candidates=candidates)]
