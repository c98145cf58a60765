"""Why edges are not those of this protocol: faults of one kind each, weighed against each other.

Where a drop cannot be read, or reads badly, one thing may be otherwise. What has a size (a chain
longer, another drop height, a post higher, the clock slow …) is a direction of the unknowns: the
score tells which to open, and its size is adjusted with all else. What has none (gates exchanged,
rods too many …) is another protocol, with which the edges are read anew. Both are judged by the
same marginal likelihood as the protocol as it is, with what the fault costs beforehand: how
improbable it is, and how wide the range of its size. Rivals of each are all others, and that this
fall is not the equations'; only a fault that beats all of them clearly is named.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.analysis.air import prior_air
from rig.analysis.annealing import LEAST, MISSED
from rig.analysis.chain_records import chain_records
from rig.analysis.diagnoses import RIGHT
from rig.analysis.drop_model import DropModel
from rig.analysis.faults import Fault, faults
from rig.analysis.fit import settle
from rig.analysis.identify import held_back, most_votes, possible, read_quickly, weigh, well_read
from rig.analysis.last_passages import APART
from rig.analysis.score_test import scores
from rig.reasons import make_reason

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterator, Sequence

    from rig.analysis.chain_records import ChainRecord
    from rig.analysis.components import Components
    from rig.analysis.faults import Premise
    from rig.analysis.fit import Fit
    from rig.analysis.identify import Reading
    from rig.analysis.score_test import Score
    from rig.arrays import Array
    from rig.reasons import Reason
    from rig.records import Drop
    from rig.vocabulary import Vocabulary


CLEAR = math.log(100.0)
"""Log odds by which a fault must beat every other one, and the protocol as it is, to be named; and
what each fault costs beforehand: there are so many drops to one with some fault."""
_NAMED = 3  # faults told where none is clear
_MARGIN = 3  # edges by which votes may fall short of what an adjusted fall matches
_TRIED = 4  # faults that are weighed: those that most edges ask for
_BEYOND = 10.0  # times what strings do to a chain together, in a fall that is not the equations'
_LEFT = 12.5  # gain that another fault may still have beside one that explains everything: 5 σ


NEITHER = Fault("")
"""No fault, but a fall that is not that of the equations."""


@dataclass(frozen=True)
class Explanation:
    """A fault that would explain a drop.

    Attributes
    ----------
    fault
        Which.
    values
        Of the reason that names it.
    log_odds
        Against the protocol as it is.
    whole
        Whether nearly all edges are read with it.
    """

    fault: Fault
    values: dict[str, Any]
    log_odds: float
    whole: bool


@dataclass(frozen=True)
class Explainer:
    """Reads one drop with one fault after another.

    Attributes
    ----------
    setting
        As stated.
    drop
        The raw record.
    clock_u
        Relative standard uncertainty of the time scale.
    components
        How much everything scatters.
    suspects
        Numbers of the gates of which any two may be exchanged.
    """

    setting: Premise
    drop: Drop
    clock_u: float
    components: Components
    suspects: Sequence[int]
    _votes: dict[Hashable, int] = field(default_factory=dict)
    """By all that a side's votes depend on: a fault of one side leaves the other as it was."""

    @cached_property
    def _faults(self) -> tuple[list[Fault], list[Fault]]:
        """Those with a size that is adjusted, and those without."""
        kinds: tuple[list[Fault], list[Fault]] = [], []
        for fault in faults(self.setting.protocol, self.setting.run, self.suspects):
            kinds[fault.shift is None].append(fault)
        return kinds

    def asked(self, fit: Fit) -> bool:
        """Whether an adjusted drop asks for some size of a fault."""
        return bool((self._scores(fit)[1] > CLEAR).any())

    def explain(self, fit: Fit | None) -> list[Explanation]:
        """Weigh all faults; the likeliest first, and only those likelier than none.

        Parameters
        ----------
        fit
            How the edges are read as the protocol is; `None` where they cannot be.
        """
        sized, discrete = self._faults
        if fit is None:
            records = self._records(self.setting)
            if any(possible(record) < LEAST * record.expected for record in records):
                return []  # too few edges came for any fall
            stated = sum(self._read_alone(record) for record in records)
            explanations = [*self._voted([*sized, *discrete], stated)]
        else:
            reading = weigh(fit)
            stated, well = self._absolute(reading, self.setting.hz), well_read(reading)
            explanations = [*self._along(fit, stated, well), *self._voted(discrete, stated)]
            likelier = [cause for cause in explanations if cause.log_odds > 0.0]
            likeliest = max(likelier, key=lambda cause: cause.log_odds, default=None)
            explained = likeliest and likeliest.whole and likeliest.fault.shift
            if not explained and (likelier or not well):
                # A rod at one end too many looks like a chain that hangs a rod's distance higher,
                # which no score tells that begins a rod off.
                explanations += self._voted(sized, stated)
            if any(cause.whole and cause.log_odds > CLEAR for cause in explanations):
                explanations += self._beyond(fit, stated)
        explanations.sort(key=lambda cause: cause.log_odds)
        # What was found in both ways counts once.
        best = {id(cause.fault): cause for cause in explanations if cause.log_odds > 0.0}
        return sorted(best.values(), key=lambda cause: -cause.log_odds)

    def _read_alone(self, record: ChainRecord) -> float:
        """Evidence of a side by itself, where the whole drop cannot be read."""
        reading = read_quickly(self.setting.protocol, [record], self.clock_u, self.components)
        if reading is None:
            return record.expected * math.log(MISSED)
        return self._absolute(reading, self.setting.hz)

    def _along(self, fit: Fit, stated: float, well: bool) -> Iterator[Explanation]:
        """Weigh the sized faults for which the score asks most, each along its direction.

        Where one fault explains a drop, another one gains that share of it by which it does the
        same: those that may be as likely are weighed too, however many these are.
        """
        by_fault, gains = self._scores(fit)
        # Of a good reading the score tells beforehand which search would end in vain; air that
        # seems to push is what a fault may save besides.
        least = min(0.0, held_back(fit)) if well else -math.inf
        ranked = [int(n) for n in np.argsort(gains)[::-1] if gains[n] > least]
        likeliest, first = 0.0, max(gains.max(initial=0.0), 1.0)
        for rank, n in enumerate(ranked):
            if (
                rank >= _TRIED and likeliest * (1.0 - gains[n] / first) > 2.0 * CLEAR
            ):  # it may be less likely than its score has it
                return
            explanation = self._open(self._faults[0][n], 0.0, fit.model, fit.x, stated, by_fault[n])
            if explanation is not None:
                likeliest = max(likeliest, explanation.log_odds)
                yield explanation

    def _beyond(self, fit: Fit, stated: float) -> Iterator[Explanation]:
        """Weigh that it is no fault, but that this fall is not the equations'."""
        if "stretch" not in fit.model.unknowns:
            return
        scales = self.components
        wider = replace(scales, stretch=_BEYOND * scales.stretch, landed=_BEYOND * scales.landed)
        x = fit.x.copy()
        model = fit.model.informed(wider, self.clock_u, x)
        reading = weigh(settle(model, x=x))
        log_odds = self._absolute(reading, self.setting.hz) - CLEAR - stated
        yield Explanation(NEITHER, {}, log_odds, whole=True)

    def _absolute(self, reading: Reading, hz: float) -> float:
        """Evidence of a reading, as it can be compared with that of another premise.

        By itself it is of times, and edges came in ticks; and it is relative to a reading in which
        all edges are strays and every rod was missed, of which others may have fewer. A rod that
        leaves no trace at a gate is one thing, and not two: else one at an end that no gate saw by
        chance would be taken for one that does not hang there.
        """
        fit, ticks = reading.fit, len(self.drop.edges) * math.log(self.setting.hz / hz)
        missed = sum(
            train.rods.size - np.setdiff1d(train.rods, train.rods[match >= 0]).size
            for role, record in fit.model.records.items()
            for train, match in zip(record.trains, fit.matches[role], strict=True)
        )
        return reading.evidence + ticks + missed * math.log(MISSED)

    def _scores(self, fit: Fit) -> tuple[list[Score], Array]:
        """Score each sized fault; and by how much it would be likelier than none, if not rare."""
        sized, _ = self._faults
        by_fault = scores(fit, [fault.shift.direction(fit.model) for fault in sized if fault.shift])
        pairs = zip(sized, by_fault, strict=True)
        return by_fault, np.array([score.gain - _occam(fault, score.u) for fault, score in pairs])

    def _records(self, setting: Premise) -> list[ChainRecord]:
        return chain_records(setting.protocol, setting.run, self.drop, setting.hz, setting.aside)

    def _voted(self, faults: Sequence[Fault], stated: float) -> Iterator[Explanation]:
        """Weigh faults of the sizes for which most edges vote: enough, not fewer than for none."""
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
        enough = 0
        for net, fault, size in candidates[:_TRIED]:
            if net < enough:
                return
            explanation = self._afresh(fault, size, stated)
            if explanation is not None:
                if explanation.whole:
                    enough = max(enough, net - 2 * _MARGIN)
                yield explanation

    def _net(self, setting: Premise, least: float = -math.inf) -> tuple[float, int]:
        """Share of the expected edges that vote for one fall, and votes less edges without.

        Both are only bounds from above where these cannot be as many as the least.
        """
        records = self._records(setting)
        expected = sum(side.expected for side in records)
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

    def _afresh(self, fault: Fault, size: float, stated: float) -> Explanation | None:
        """Weigh a fault of some size, with which the edges are read anew."""
        premise = fault.premise(self.setting, size)
        reading = read_quickly(
            premise.protocol, self._records(premise), self.clock_u, self.components
        )
        if reading is None:
            return None
        if fault.shift is not None:
            return self._open(fault, size, reading.fit.model, reading.fit.x, stated)
        u, occam = 0.0, math.log(len(fault.sizes))
        if fault.of_air:
            # Its size was integrated out, as everything that is unknown.
            fit, occam = reading.fit, 0.0
            size = fit.model.kappa(fit.x)
            u = float(fit.estimate.own_u[fit.model.unknowns["drag"]][0])
        return self._explanation(fault, size, u, reading, premise.hz, stated + occam)

    def _open(
        self,
        fault: Fault,
        size: float,
        model: DropModel,
        x: Array,
        stated: float,
        score: Score | None = None,
        *,
        last: bool = False,
    ) -> Explanation | None:
        """Adjust a drop with the size of a fault as one thing more that is not known, and weigh it.

        Parameters
        ----------
        size
            With which it was read.
        model, x
            As it was read.
        score
            Of what the fault would do besides, to begin with.
        last
            Whether the rods that pass beams are taken as they are: with a size other ones may, and
            the drop is adjusted once more.
        """
        opened, x = model.changed(suspects=(fault.suspect(model),)), np.append(x, 0.0)
        if score is not None:
            largest = max(fault.sizes)
            x += float(np.clip(score.size, -largest, largest)) * np.append(score.follow, 1.0)
        reading = weigh(settle(opened, x=x))
        estimate = reading.fit.estimate
        further, u = float(estimate.x[-1]), float(estimate.own_u[-1])
        if not APART * u < abs(size + further) <= max(fault.sizes):
            return None  # a smaller one may be none, and a larger one has another reason
        premise = fault.premise(self.setting, size + further)
        if not last and self._expects_others(premise, model):
            moved = DropModel.of(
                premise.protocol,
                self._records(premise),
                model.guesses,
                self.clock_u,
                self.components,
            )
            return self._open(fault, size + further, moved, estimate.x[:-1], stated, last=True)
        hz = fault.premise(self.setting, size).hz / (1.0 + opened.unknowns.rate[-1] * further)
        return self._explanation(fault, size + further, u, reading, hz, stated)

    def _expects_others(self, premise: Premise, model: DropModel) -> bool:
        """Whether other rods pass other beams than those of a model."""
        return any(
            not np.array_equal(train.rods, stated.rods)
            for record in self._records(premise)
            for train, stated in zip(record.trains, model.records[record.role].trains, strict=True)
        )

    def _explanation(
        self, fault: Fault, size: float, u: float, reading: Reading, hz: float, stated: float
    ) -> Explanation:
        remaining = max((score.gain for score in self._scores(reading.fit)[0]), default=0.0)
        log_odds = self._absolute(reading, hz) - CLEAR - stated
        complete = well_read(reading) and remaining < _LEFT
        return Explanation(fault, fault.values(size, u), log_odds, complete)


def _occam(fault: Fault, u: float) -> float:
    """What a size costs that could have been any: ln of their range over what is left of it."""
    span = max(fault.sizes) - min(fault.sizes)
    return math.log(max(1.0, span / (math.sqrt(2.0 * math.pi) * u)))


def _key(setting: Premise, record: ChainRecord) -> tuple[Hashable, ...]:
    """Return what a side's reading depends on."""
    protocol = setting.protocol
    scene = setting.hz, protocol.drop.value, protocol.gravity.value, prior_air(protocol)[0]
    edges = [part.tobytes() for train in record.trains for part in (train.levels, train.edge)]
    return record.role, *scene, *edges


def name_fault(
    causes: Sequence[Explanation], words: Vocabulary, accused: Sequence[Reason] = ()
) -> list[Reason]:
    """Name the fault that explains a drop clearly, or the likeliest ones.

    Parameters
    ----------
    words
        Of the scene.
    accused
        What is said where no fault is clear.
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
