"""Diagnosis of gates whose edges do not match the chains of the protocol, after the fit.

Such gates are reported, never fitted away. If a diagnosis or the fit is odd,
`rig.analysis.explanations` compares the possible causes.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from rig.analysis.annealing import MISSED
from rig.analysis.chain_records import SIDES, ChainRecord, EdgeTrain
from rig.analysis.distributions import most_by_chance
from rig.analysis.equations import STRAY, standardise
from rig.analysis.faults import gate_values
from rig.analysis.fit import Begun, Fit
from rig.arrays import Index
from rig.protocol.protocol import Protocol
from rig.reasons import Reason, make_reason
from rig.wordings import Severity

STRANGE = 0.5
"""Matched share of its expected edges below which a gate disagrees with its chain; below `RIGHT`
too, if more than `FEW` are missing."""
FEW = 8
FEW_GATES = 8
"""Most gates with which any two are tried as exchanged if some disagree."""
RIGHT = 0.8
_BY_CHANCE = 1e-4  # probability of missing a rod by chance below which the rod is absent


class Diagnosis(NamedTuple):
    """Faults of a drop, its gates and chains.

    Attributes
    ----------
    suspects
        Numbers of the gates that do not match their chain.
    odd
        Whether edges are missing or surplus by more than chance.
    known
        Whether the reasons explain everything, so that no other fault is searched for: a rod is
        missing.
    accused
        Reasons that blame gates, chains or clock.
    """

    reasons: tuple[Reason, ...] = ()
    suspects: tuple[int, ...] = ()
    odd: bool = False
    known: bool = False
    accused: tuple[Reason, ...] = ()


def diagnose(fit: Fit) -> Diagnosis:
    """Return the gates that do not match the chains of the protocol, with reasons."""
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
            # A gate with few expected edges may miss a rod by chance, without effect on the result.
            code = "gate_disagrees" if gate.match.size >= 2 * SIDES else "gate_disagrees_few"
            reasons.append(make_reason(code, words, **where, share=gate.share))
        elif gate.off > STRAY:
            # With equal, evenly spaced rods an exchanged gate fits well at a wrong height.
            reasons.append(make_reason("gate_off", words, **where, deviations=gate.off))
    # An exchanged gate matches rods further along the chain, or at another height.
    displaced = [gate for gate in alive if gate.extra >= SIDES and gate.unseen & gate.ends]
    displaced += [
        gate for pair in combinations(alive, 2) if _counts_crossed(*pair) for gate in pair
    ]
    suspects = [*displaced, *(gate for gate in alive if gate.off > STRAY)]
    if strange and len(gates) <= FEW_GATES:
        # With few gates a side may fit another fall if a gate belongs to the other side.
        suspects = sorted(alive, key=lambda gate: not gate.strange)
    odd = any(reason.severity is Severity.VOID for reason in reasons) or len(displaced) >= SIDES
    odd |= any(_other_ends(side) for _, side in by_side)
    numbers = dict.fromkeys(gate.train.gate for gate in suspects)
    return Diagnosis((*reasons, *doubts), tuple(numbers), odd)


def _missing_rod(
    protocol: Protocol, record: ChainRecord, gates: Sequence[_Seen]
) -> Iterator[Reason]:
    """Yield the reason for a rod that no gate saw, unless that may be chance."""
    rods = record.chain.chain.rods
    due, seen = np.zeros(rods), np.zeros(rods)
    for gate in gates:  # a rod missed at a gate is missed with both sides
        due[np.unique(gate.train.rods)] += 1.0
        seen[np.unique(gate.train.rods[gate.match >= 0])] += 1.0
    absent = np.flatnonzero((due > 0.0) & (seen == 0.0))
    if absent.size != 1 or absent[0] in (0, rods - 1):
        return  # at an end, the chain may have fewer rods or another drop height
    rod = int(absent[0])
    due_others = due.sum() - due[rod]
    missed = max(MISSED, (due_others - seen.sum()) / max(1.0, due_others))
    if rods * missed ** due[rod] <= _BY_CHANCE:
        values = {"rod": rod + 1, "rods": rods, "name": record.chain.name, "side": record.role}
        yield make_reason("rod_missing", protocol.vocabulary, **values)


def silent(protocol: Protocol, records: Collection[ChainRecord]) -> list[Reason]:
    """Return reasons for gates without edges while the others have theirs."""
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
    """A gate's matched edges, and its fitted height error `off` in standard uncertainties."""

    role: str
    train: EdgeTrain
    match: Index
    matched: int
    off: float

    @property
    def share(self) -> float:
        """Matched share of its expected edges."""
        return self.matched / self.match.size

    @property
    def extra(self) -> int:
        """Number of observed edges that belong to no rod."""
        return self.train.times.size - self.matched

    @property
    def unseen(self) -> set[int]:
        """Rods without a matched edge."""
        rods = self.train.rods
        return set(rods.tolist()) - set(rods[self.match >= 0].tolist())

    @property
    def ends(self) -> set[int]:
        """The first and the last rod that should pass."""
        return {int(self.train.rods[0]), int(self.train.rods[-1])}

    @property
    def strange(self) -> bool:
        """Whether too few of its expected edges are matched."""
        missing = self.match.size - self.matched
        return self.share < STRANGE or (self.share < RIGHT and missing > FEW)


def _gates(fit: Fit) -> list[_Seen]:
    beams = fit.model.unknowns["beams"]
    off = np.abs(standardise(fit.estimate.x[beams], fit.model.unknowns.sd[beams]))
    return [
        _Seen(role, train, match, int((match >= 0).sum()), float(off[train.gate]))
        for role, record in fit.model.records.items()
        for train, _, match in record.by_gate(fit.matches[role])
        if match.size
    ]


def _values(protocol: Protocol, train: EdgeTrain) -> dict[str, Any]:
    assert protocol.gates is not None
    return gate_values(protocol.gates.gates[train.gate])


def _counts_crossed(one: _Seen, other: _Seen) -> bool:
    """Whether the edge counts of two gates match each other's expectation, not their own.

    The gate with too few edges must lack a rod at an end of the chain; by chance, missed rods may
    be anywhere.
    """
    came, due = (one.train.times.size, other.train.times.size), (one.match.size, other.match.size)
    own = abs(came[0] - due[0]) + abs(came[1] - due[1])
    crossed = abs(came[0] - due[1]) + abs(came[1] - due[0])
    fewer, more = sorted((one, other), key=lambda gate: gate.extra)
    lacks_end = bool(fewer.unseen & fewer.ends)
    return own - crossed >= 2 * SIDES and lacks_end and more.extra >= SIDES


def gates_too_low(
    protocol: Protocol, records: Iterable[ChainRecord], begun: Begun | None
) -> tuple[int, ...]:
    """Return the lowest gates beside the striking chain that miss more rods than by chance.

    There, rods strike before they pass, or lie in the beam. The highest gate is never left out.
    The rate of chance misses is that of all other gates.

    Parameters
    ----------
    records
        The chains with their trains.
    begun
        `None` if the drop is not identified: then the number of edges is used.

    Returns
    -------
    tuple of int
        Numbers of the gates in the protocol's list.
    """
    assert protocol.gates is not None
    heights = [gate.height for gate in protocol.gates.gates]
    struck: list[tuple[EdgeTrain, int, int]] = []
    rods, hidden = 0, 0
    for record in records:
        match = np.full(record.edge_count, -1) if begun is None else begun.matches[record.role]
        for train, _, edges in record.by_gate(match):
            due = np.unique(train.rods).size
            if not due or not train.times.size:
                continue
            if begun is None:
                unseen = max(0, due - train.times.size * due // train.rods.size)
            else:
                unseen = np.unique(train.rods[edges < 0]).size
            rods, hidden = rods + due, hidden + unseen
            if record.role == "impact":
                struck.append((train, due, unseen))
    low: list[int] = []
    for train, due, unseen in sorted(struck, key=lambda row: heights[row[0].gate])[:-1]:
        rods, hidden = rods - due, hidden - unseen
        missed = MISSED * train.rods.size / due  # each edge of a rod may be missed
        if unseen <= most_by_chance(due, max(missed, hidden / rods)):
            break
        low.append(train.gate)
    return tuple(low)


def _other_ends(gates: list[_Seen]) -> bool:
    """Whether no gate of a side saw the first or last rod, or all have edges after the last."""
    if not gates:
        return False
    unseen = set.intersection(*(gate.unseen for gate in gates))
    ends = set.union(*(gate.ends for gate in gates))
    return bool(unseen & ends) or all(
        gate.train.times.size - 1 - int(gate.match.max(initial=-1)) >= SIDES for gate in gates
    )
