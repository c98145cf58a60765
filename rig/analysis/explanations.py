"""Why edges are not those of this protocol: faults of one kind each, weighed against each other.

A drop that cannot be read, or reads badly, is read again as if one thing were otherwise: a chain
longer or of more rods, another drop height, a post higher, the clock slow, two gates exchanged …
Each such protocol is judged by the same marginal likelihood as the stated one, with what the fault
costs beforehand: how improbable it is, and how wide the range of its size. Only a fault that beats
all others clearly is named.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.analysis.annealing import MISSED
from rig.analysis.chain_records import chain_records
from rig.analysis.drop_model import DropModel, prior_air
from rig.analysis.fit import settle
from rig.analysis.identify import held_back, most_votes, possible, read_quickly, weighed, well_read
from rig.analysis.score_test import scores
from rig.reasons import make_reason

if TYPE_CHECKING:
    from collections.abc import Hashable, Sequence

    from rig.analysis.chain_records import ChainRecord
    from rig.analysis.components import Components
    from rig.analysis.faults import Fault, Premise
    from rig.analysis.fit import Fit
    from rig.analysis.identify import Reading
    from rig.analysis.score_test import Score
    from rig.reasons import Reason
    from rig.records import Drop
    from rig.vocabulary import Vocabulary

CLEAR = math.log(100.0)
"""Log odds by which a fault must beat every other one, and the protocol as it is, to be named."""
RARE = math.log(100.0)
"""How many drops of a kind there are to one with some fault: what each of them costs beforehand."""
_NAMED = 3  # faults told where none is clear
_SOME = 0.6  # share of a side's expected edges without which nothing is tried
_NEAR = 0.02  # how far off the expected α may be, to count votes by
_VOTED = 0.8  # share of all expected edges that must vote for a fall with a fault
_TRIED = 4  # faults that are weighed: those that most edges ask for
_STEPS = 4  # of the search for a size
_DONE = 0.1  # standard uncertainties: a step so short is the last
_TOLD = 3.0  # standard uncertainties: a smaller size may as well be none
_LEFT = 12.5  # gain that another fault may still have beside one that explains everything: 5 σ


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


class Explainer:
    """Reads one drop with one fault after another.

    Parameters
    ----------
    setting
        As stated.
    drop
        The raw record.
    clock_u
        Relative standard uncertainty of the time scale.
    components
        How much everything scatters.
    faults
        That are weighed.
    """

    def __init__(
        self,
        setting: Premise,
        drop: Drop,
        clock_u: float,
        components: Components,
        faults: Sequence[Fault],
    ) -> None:
        self.setting = setting
        self.drop = drop
        self.clock_u = clock_u
        self.components = components
        self.faults = faults
        self.steady = [one for one in faults if one.shift is not None]
        # A fault of one side leaves the other as it was.
        self._votes: dict[Hashable, int] = {}

    def asked(self, fit: Fit) -> bool:
        """Whether an adjusted drop asks for some size of a fault."""
        return any(gain > RARE for gain in self._gains(fit))

    def _gains(self, fit: Fit) -> list[float]:
        """By how much each fault of some size would be likelier than none, if none were rare."""
        found = zip(self.steady, self._scores(fit), strict=True)
        return [score.gain - _occam(one, score.u) for one, score in found]

    def explain(self, fit: Fit | None) -> list[Explanation]:
        """Weigh all faults; the likeliest first, and only those likelier than none.

        Parameters
        ----------
        fit
            How the edges are read as the protocol is; `None` where they cannot be.
        """
        found: list[Explanation | None] = []
        if fit is None:
            records = self._records(self.setting)
            if any(possible(one) < _SOME * one.expected for one in records):
                return []  # too few edges came for any fall
            sides = [
                read_quickly(self.setting.protocol, [one], self.clock_u, self.components)
                for one in records
            ]
            stated = sum(_freely(one) for one in sides if one is not None)
            stated = self._absolute(self.setting, stated)
            others, well = self.faults, False
        else:
            reading = weighed(fit)
            stated = self._absolute(self.setting, _freely(reading))
            gains, well = np.array(self._gains(fit)), well_read(reading)
            ranked = np.argsort(gains)[::-1][:_TRIED]
            # Of a good reading the score tells beforehand which search would end in vain; air that
            # seems to push is what a fault may save besides.
            ranked = ranked[gains[ranked] > min(0.0, held_back(fit))] if well else ranked
            found += [self._sought(self.steady[n], 0.0, reading, stated) for n in ranked]
            others = [one for one in self.faults if one.shift is None or not well]
        found += [self._afresh(one, size, stated) for one, size in self._voted(others)]
        if well and any(one is not None and one.log_odds > 0.0 for one in found):
            # A rod at one end too many looks like a chain that hangs a rod's distance higher, which
            # no score tells that begins a rod off.
            found += [self._afresh(one, size, stated) for one, size in self._voted(self.steady)]
        likelier = [one for one in found if one is not None and one.log_odds > 0.0]
        # What was found in both ways counts once.
        best = {id(one.fault): one for one in sorted(likelier, key=lambda one: one.log_odds)}
        return sorted(best.values(), key=lambda one: -one.log_odds)

    def _absolute(self, setting: Premise, evidence: float) -> float:
        """Evidence of a reading, as it can be compared with that of another setting.

        By itself it is of times, and edges came in ticks; and it is relative to a reading in which
        all edges are strays and every rod was missed, of which others may have fewer.
        """
        ticks = len(self.drop.edges) * math.log(self.setting.hz / setting.hz)
        expected = sum(one.expected for one in self._records(setting))
        return evidence + ticks + expected * math.log(MISSED)

    def _scores(self, fit: Fit) -> list[Score]:
        return scores(fit, [one.direction(fit.model) for one in self.steady])

    def _records(self, setting: Premise) -> list[ChainRecord]:
        return chain_records(setting.protocol, setting.run, self.drop, setting.hz)

    def _voted(self, faults: Sequence[Fault]) -> list[tuple[Fault, float]]:
        """Faults of the sizes for which most edges vote: enough, and no fewer than for none."""
        least = self._net(self.setting)[1]
        found = []
        for fault in faults:
            sized = [(*self._net(fault.change(self.setting, size)), size) for size in fault.sizes]
            share, net, size = max(sized, key=lambda row: row[1])
            if share >= _VOTED and net >= least:
                found.append((net, fault, size))
        found.sort(key=lambda row: -row[0])
        return [(fault, size) for _, fault, size in found[:_TRIED]]

    def _net(self, setting: Premise) -> tuple[float, int]:
        """Share of the expected edges that vote for one fall, and votes less edges without."""
        votes = 0
        records = self._records(setting)
        expected = sum(one.expected for one in records)
        for record in records:
            key = expected, *_key(setting, record)
            if key not in self._votes:
                self._votes[key] = most_votes(
                    setting.protocol, record, self.clock_u, self.components
                )
            votes += self._votes[key]
        return votes / max(1, expected), 2 * votes - expected

    def _afresh(self, fault: Fault, size: float, stated: float) -> Explanation | None:
        """Weigh a fault of some size, with which the edges are read anew."""
        setting = fault.change(self.setting, size)
        reading = read_quickly(
            setting.protocol, self._records(setting), self.clock_u, self.components
        )
        if reading is None:
            return None
        if fault.shift is not None:
            return self._sought(fault, size, reading, stated)
        u, occam = 0.0, math.log(len(fault.sizes))
        if fault.of_air:
            # Its size was integrated out, as everything that is unknown.
            fit, occam = reading.fit, 0.0
            at, estimate = fit.model.unknowns["drag"], fit.estimate
            size = fit.model.kappa(estimate.x)
            u = math.sqrt(estimate.covariance[at, at].item()) * float(estimate.sd[at][0])
        return self._explanation(fault, size, u, reading, occam, stated)

    def _sought(
        self, fault: Fault, size: float, reading: Reading, stated: float
    ) -> Explanation | None:
        """Find a fault's likeliest size by Newton's method, and weigh it."""
        for _ in range(_STEPS):
            fit = reading.fit
            (score,) = scores(fit, [fault.direction(fit.model)])
            if not abs(score.size) > _DONE * score.u:
                break
            tried = float(np.clip(size + score.size, min(fault.sizes), max(fault.sizes)))
            setting = fault.change(self.setting, tried)
            model = DropModel(
                setting.protocol,
                self._records(setting),
                fit.model.guesses,
                self.clock_u,
                self.components,
            )
            other = weighed(settle(model, x=fit.x + (tried - size) * score.follow))
            if other.evidence < reading.evidence:
                break
            size, reading = tried, other
        if not abs(size) > _TOLD * score.u:
            return None  # it is better read for another reason than that
        return self._explanation(fault, size, score.u, reading, _occam(fault, score.u), stated)

    def _explanation(
        self, fault: Fault, size: float, u: float, reading: Reading, occam: float, stated: float
    ) -> Explanation:
        left = max((score.gain for score in self._scores(reading.fit)), default=0.0)
        evidence = self._absolute(fault.change(self.setting, size), _freely(reading))
        return Explanation(
            fault,
            fault.values(size, u),
            evidence - occam - RARE - stated,
            well_read(reading) and left < _LEFT,
        )


def _freely(reading: Reading) -> float:
    """Evidence of a reading where a rod that leaves no trace at a gate is one thing, and not two.

    Else a rod at an end that no gate saw by chance would be taken for one that does not hang there.
    """
    unseen = sum(
        len({*train.rods.tolist()} - {*train.rods[match >= 0].tolist()})
        for role, record in reading.fit.model.records.items()
        for train, match in zip(record.trains, reading.fit.matches[role], strict=True)
    )
    return reading.evidence - unseen * math.log(MISSED)


def _occam(fault: Fault, u: float) -> float:
    """What a size costs that could have been any: ln of their range over what is left of it."""
    span = max(fault.sizes) - min(fault.sizes)
    return math.log(max(1.0, span / (math.sqrt(2.0 * math.pi) * u)))


def _key(setting: Premise, record: ChainRecord) -> tuple[Hashable, ...]:
    """Return what a side's reading depends on."""
    protocol = setting.protocol
    levels = b"".join(train.levels.tobytes() for train in record.trains)
    channels = tuple(train.edge.tobytes() for train in record.trains)
    return (
        record.role, levels, channels, setting.hz, protocol.drop.value, protocol.gravity.value,
        prior_air(protocol)[0],
    )  # fmt: skip


def explained(
    found: Sequence[Explanation], words: Vocabulary, accused: Sequence[Reason] = ()
) -> list[Reason]:
    """Name the fault that explains a drop clearly, or the likeliest ones.

    Parameters
    ----------
    words
        Of the scene.
    accused
        What is said where no fault is clear.
    """
    second = max([0.0, *(one.log_odds for one in found[1:])])
    if found and found[0].whole and found[0].log_odds - second > CLEAR:
        best, log_odds = found[0], found[0].log_odds - second
        return [make_reason(best.fault.code, words, **best.values, log_odds=log_odds)]
    if not found or found[0].log_odds < CLEAR:
        return [*accused]
    candidates = [{"code": one.fault.code, "values": one.values} for one in found[:_NAMED]]
    return [make_reason("unclear_fault", words, candidates=candidates)]
