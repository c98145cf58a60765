"""Which gates see something else than they should, once a drop is adjusted.

It is said and never fitted away. What it may be is weighed by `rig.analysis.explanations`, which is
asked where something here, or in the adjustment itself, is odd.
"""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rig.analysis.annealing import MISSED
from rig.analysis.chain_records import SIDES
from rig.analysis.distributions import most_by_chance
from rig.analysis.equations import STRAY, scaled
from rig.analysis.faults import gate_values
from rig.reasons import Reason, make_reason
from rig.wordings import Severity

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Sequence

    from rig.analysis.chain_records import ChainRecord, EdgeTrain
    from rig.analysis.fit import Fit
    from rig.arrays import Index
    from rig.protocol.protocol import Protocol


STRANGE = 0.5
"""Share of its expected edges below which a gate sees something else than its chain; below `RIGHT`
too, where more than `FEW` are missing."""
FEW = 8
FEW_GATES = 8
"""Gates of which any two may be exchanged where some see something else."""
RIGHT = 0.8
_BY_CHANCE = 1e-4  # probability below which a rod that nobody saw is none


class Diagnosis(NamedTuple):
    """What is wrong with a drop, its gates and chains.

    Attributes
    ----------
    suspects
        Numbers of the gates that see something else than they should.
    odd
        Whether edges are missing, or are too many, in a way that is hardly chance.
    known
        Whether what is wrong explains all of it, and nothing else is to be sought: rods come to
        rest above gates, or one is missing.
    accused
        Those of the reasons that blame gates, chains or clock.
    """

    reasons: tuple[Reason, ...] = ()
    suspects: tuple[int, ...] = ()
    odd: bool = False
    known: bool = False
    accused: tuple[Reason, ...] = ()


def diagnose(fit: Fit) -> Diagnosis:
    """Look for gates that do not see the chains of the protocol."""
    protocol, records = fit.model.protocol, fit.model.records
    gates, words = _gates(fit), protocol.vocabulary
    doubts = silent(protocol, records.values())
    if aside := [train for record in records.values() for train in record.aside]:
        at = [_values(protocol, train) for train in aside]
        doubts.append(make_reason("low_gates_miss_rods", words, at=at))
    alive = [gate for gate in gates if gate.train.times.size]
    by_side = [
        (record, [gate for gate in alive if gate.role == role]) for role, record in records.items()
    ]
    strange = [gate.train.gate for gate in alive if gate.strange]
    absent = [reason for side in by_side for reason in _missing_rod(protocol, *side)]
    if absent and not strange:
        return Diagnosis((*absent, *doubts), known=True)
    reasons: list[Reason] = []
    for gate in alive:
        where = _values(protocol, gate.train)
        if gate.strange:
            # A rod may be missed by chance, and a gate without any bears on nothing.
            code = "gate_disagrees" if gate.match.size >= 2 * SIDES else "gate_disagrees_few"
            reasons.append(make_reason(code, words, **where, share=gate.share))
        elif gate.off > STRAY:
            # By rods alike and evenly spaced an exchanged gate is fitted well, at a wrong height.
            reasons.append(make_reason("gate_off", words, **where, deviations=gate.off))
    # An exchanged gate fits what it should not see rods away, or at another height.
    displaced = [gate for gate in alive if gate.extra >= SIDES and gate.unseen & gate.ends]
    displaced += [
        gate for pair in combinations(alive, 2) if _counts_crossed(*pair) for gate in pair
    ]
    suspects = [*displaced, *(gate for gate in alive if gate.off > STRAY)]
    if strange and len(gates) <= FEW_GATES:
        # A side of few gates is read well as another fall where one of them is the other side's.
        suspects = sorted(alive, key=lambda gate: not gate.strange)
    odd = any(reason.severity is Severity.VOID for reason in reasons) or len(displaced) >= SIDES
    odd |= any(_other_ends(side) for _, side in by_side)
    numbers = dict.fromkeys(gate.train.gate for gate in suspects)
    return Diagnosis((*reasons, *doubts), tuple(numbers), odd)


def _missing_rod(
    protocol: Protocol, record: ChainRecord, gates: Sequence[_Seen]
) -> Iterator[Reason]:
    """Name the rod that no gate saw, while its neighbours passed, unless that may be chance."""
    rods = record.chain.chain.rods
    due, seen = np.zeros(rods), np.zeros(rods)
    for gate in gates:  # at each of which a rod that leaves no trace leaves none of either side
        due[np.unique(gate.train.rods)] += 1.0
        seen[np.unique(gate.train.rods[gate.match >= 0])] += 1.0
    absent = np.flatnonzero((due > 0.0) & (seen == 0.0))
    if absent.size != 1 or absent[0] in (0, rods - 1):
        return  # at an end the chain may have less of them, or hang elsewhere
    rod = int(absent[0])
    due_others = due.sum() - due[rod]
    missed = max(MISSED, (due_others - seen.sum()) / max(1.0, due_others))
    if rods * missed ** due[rod] <= _BY_CHANCE:
        yield make_reason(
            "rod_missing",
            protocol.vocabulary,
            rod=rod + 1,
            rods=rods,
            name=record.chain.name,
            side=record.role,
        )


def silent(protocol: Protocol, records: Collection[ChainRecord]) -> list[Reason]:
    """Name the gates that gave no edges, while the others gave theirs."""
    gates = [train for record in records for train in record.trains if train.rods.size]
    heard = [train for train in gates if train.times.size]
    if sum(gate.times.size for gate in heard) <= STRANGE * sum(gate.rods.size for gate in heard):
        return []
    reasons = []
    for record in records:
        dead = [gate for gate in record.trains if gate.rods.size and not gate.times.size]
        if len(dead) == len(record.trains) > 1:
            reasons.append(make_reason("side_silent", protocol.vocabulary, side=record.role))
        else:
            reasons += [
                make_reason("gate_silent", protocol.vocabulary, **_values(protocol, train))
                for train in dead
            ]
    return reasons


class _Seen(NamedTuple):
    """A gate, how many of its expected edges it saw, and how far off its beam seems to be.

    The latter is in standard uncertainties of its height.
    """

    role: str
    train: EdgeTrain
    match: Index
    matched: int
    off: float

    @property
    def share(self) -> float:
        """Of its expected edges."""
        return self.matched / self.match.size

    @property
    def missing(self) -> int:
        """How many expected edges it did not see."""
        return self.match.size - self.matched

    @property
    def extra(self) -> int:
        """How many of its edges belong to no rod."""
        return self.train.times.size - self.matched

    @property
    def unseen(self) -> set[int]:
        """Rods of which no edge was seen."""
        rods = self.train.rods
        return set(rods.tolist()) - set(rods[self.match >= 0].tolist())

    @property
    def ends(self) -> set[int]:
        """The first and the last rod that should pass."""
        return {int(self.train.rods[0]), int(self.train.rods[-1])}

    @property
    def strange(self) -> bool:
        """Whether it sees something else than its chain."""
        return self.share < STRANGE or (self.share < RIGHT and self.missing > FEW)


def _gates(fit: Fit) -> list[_Seen]:
    beams = fit.model.unknowns["beams"]
    off = np.abs(scaled(fit.estimate.x[beams], fit.model.unknowns.sd[beams]))
    return [
        _Seen(role, train, match, int((match >= 0).sum()), float(off[train.gate]))
        for role, record in fit.model.records.items()
        for train, match in zip(record.trains, fit.matches[role], strict=True)
        if match.size
    ]


def _values(protocol: Protocol, train: EdgeTrain) -> dict[str, Any]:
    assert protocol.gates is not None
    return gate_values(protocol.gates.gates[train.gate])


def _counts_crossed(one: _Seen, other: _Seen) -> bool:
    """Whether two gates gave as many edges as each other should have, and not as themselves.

    The one that gave too few then did not see a rod at an end; those that leave no trace by chance
    are anywhere.
    """
    came, due = (one.train.times.size, other.train.times.size), (one.match.size, other.match.size)
    own = abs(came[0] - due[0]) + abs(came[1] - due[1])
    crossed = abs(came[0] - due[1]) + abs(came[1] - due[0])
    if own - crossed < 2 * SIDES:
        return False
    fewer, more = sorted((one, other), key=lambda gate: gate.extra)
    return bool(fewer.unseen & fewer.ends) and more.extra >= SIDES


def gates_too_low(
    protocol: Protocol, records: Iterable[ChainRecord], fit: Fit | None
) -> tuple[int, ...]:
    """Find the lowest gates beside the chain that strikes that miss more rods than by chance.

    Some strike before, or lie there. The highest gate is none of them, and chance is as large as
    all others miss.

    Parameters
    ----------
    records
        The chains with their trains.
    fit
        `None` where it is not known which rods edges are: then their number tells.

    Returns
    -------
    tuple of int
        Their numbers in the protocol's list.
    """
    assert protocol.gates is not None
    heights = [gate.height for gate in protocol.gates.gates]
    struck: list[tuple[EdgeTrain, int, int]] = []
    rods, hidden = 0, 0
    for record in records:
        for n, train in enumerate(record.trains):
            due = np.unique(train.rods).size
            if not due or not train.times.size:
                continue
            if fit is None:
                unseen = max(0, due - train.times.size * due // train.rods.size)
            else:
                unseen = np.unique(train.rods[fit.matches[record.role][n] < 0]).size
            rods, hidden = rods + due, hidden + unseen
            if record.role == "impact":
                struck.append((train, due, unseen))
    low: list[int] = []
    for train, due, unseen in sorted(struck, key=lambda row: heights[row[0].gate])[:-1]:
        rods, hidden = rods - due, hidden - unseen
        missed = MISSED * train.rods.size / due  # of a rod each edge may be
        if unseen <= most_by_chance(due, max(missed, hidden / rods)):
            break
        low.append(train.gate)
    return tuple(low)


def _other_ends(gates: list[_Seen]) -> bool:
    """Whether no gate of a side saw the first or the last rod, or all saw further ones."""
    if not gates:
        return False
    unseen = set.intersection(*(gate.unseen for gate in gates))
    ends = set.union(*(gate.ends for gate in gates))
    return bool(unseen & ends) or all(
        gate.train.times.size - 1 - int(gate.match.max(initial=-1)) >= SIDES for gate in gates
    )
