"""What is wrong with the rig, by the edges: dead and exchanged gates, chains of other rods.

It is said and never fitted away: a drop whose gates or chains are not those of the protocol is
void, with the fault as its reason. An adjusted drop is diagnosed by what the adjustment left over;
`rig.analysis.explanations` weighs what is suspected against all else that it may be.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.analysis.align import align, possible
from rig.analysis.chain_records import EdgeTrain
from rig.analysis.equations import scaled
from rig.analysis.explanations import exchanged, name_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from rig.analysis.fit import Fit
    from rig.analysis.trajectory import Trajectory
    from rig.protocol.protocol import Gate

    Array = NDArray[np.float64]
    Index = NDArray[np.intp]

STRANGE = 0.5
"""Share of its expected edges below which a gate sees something else than its chain; below `RIGHT`
too, where more than `FEW` are missing."""
FEW = 8
IMPLAUSIBLE = 6.0
"""Standard uncertainties beyond which a beam is not where the protocol says: by rods all alike and
evenly spaced, an exchanged gate is fitted well at a wrong height."""
RIGHT = 0.8
"""Share that says that it was exchanged with another."""
_WIDTH = 1e-3  # m: how far off an edge of another gate or rod may be
_SOME = 3  # edges expected of a gate that say too little when they are missing
_ENOUGH = 3  # gates that must agree on how many rods there are
_MOST = 3  # rods by which a chain may differ


class Diagnosis(NamedTuple):
    """What is wrong, in words: beyond use, and worth a remark.

    Attributes
    ----------
    suspects
        Numbers of the gates that see something else than they should.
    """

    void: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    suspects: tuple[int, ...] = ()


def diagnose(fit: Fit) -> Diagnosis:
    """Look for gates and chains that are not those of the protocol."""
    gates = _gates(fit)
    void: list[str] = []
    doubts = [
        f"{name_of(_gate(fit, one.train))} gave no edges: it is dead or not plugged in"
        for one in gates
        if one.train.times.size == 0
    ]
    alive = [one for one in gates if one.train.times.size]
    found: set[int] = set()
    suspect = [gate for gate in alive if gate.odd or gate.off > IMPLAUSIBLE]
    # Exchanged gates first: each of them alone would look like a gate that sees nonsense.
    for one, other in combinations(suspect, 2):
        if not {one.train.gate, other.train.gate} & found and _exchanged(fit, one, other):
            void.append(exchanged(_gate(fit, one.train), _gate(fit, other.train)))
            found |= {one.train.gate, other.train.gate}
    for gate in alive:
        name = name_of(_gate(fit, gate.train))
        if gate.train.gate in found:
            continue
        if gate.strange:
            # Two edges may be missed by chance, and a gate without any bears on nothing.
            (void if gate.match.size > _SOME else doubts).append(
                f"{name} sees something else than this chain: only {gate.share:.0%} of its "
                "expected edges are there"
            )
        elif gate.off > IMPLAUSIBLE:
            void.append(f"{name} is off its height by {gate.off:.0f} times its uncertainty")
    for role in fit.model.records:
        void += _rods(fit, role, [gate for gate in alive if gate.role == role])
    return Diagnosis(tuple(void), tuple(doubts), tuple(gate.train.gate for gate in suspect))


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
    def odd(self) -> bool:
        """Whether a rod's two edges are missing, or there are two too many."""
        return self.match.size - self.matched > 1 or self.train.times.size - self.matched > 1

    @property
    def strange(self) -> bool:
        """Whether it sees something else than its chain."""
        missing = self.match.size - self.matched
        return self.share < STRANGE or (self.share < RIGHT and missing > FEW)


def _gates(fit: Fit) -> list[_Seen]:
    beams = fit.model.unknowns["beams"]
    off = np.abs(scaled(fit.estimate.x[beams], fit.model.unknowns.sd[beams]))
    return [
        _Seen(role, train, match, int((match >= 0).sum()), float(off[train.gate]))
        for role, record in fit.model.records.items()
        for train, match in zip(record.trains, fit.matches[role], strict=True)
        if match.size
    ]


def _gate(fit: Fit, train: EdgeTrain) -> Gate:
    assert fit.model.protocol.gates is not None
    return fit.model.protocol.gates.gates[train.gate]


def _exchanged(fit: Fit, one: _Seen, other: _Seen) -> bool:
    """Whether each gate's edges are what the other should have seen, and better than its own.

    Gates that are a whole number of rods apart see nearly the same: the ends of the chain tell.
    """
    pairs = ((one, other), (other, one))
    own = one.matched + other.matched + 1
    if max(one.off, other.off) > IMPLAUSIBLE:
        own = 0  # beams at impossible heights fit anything: that they fit their own means nothing
    if sum(min(a.match.size, b.train.times.size) for a, b in pairs) <= own:
        return False  # not even if all of them were
    counts = []
    for expected, observed in pairs:
        count = _count_as(fit, expected, observed)
        if count <= RIGHT * expected.match.size:
            return False
        counts.append(count)
    return sum(counts) > own


def _count_as(fit: Fit, expected: _Seen, observed: _Seen) -> int:
    """Count the edges of one gate that are what another should have seen; 0 where too few are."""
    train = replace(
        expected.train,
        times=observed.train.times,
        blocked=observed.train.blocked,
        burst=observed.train.burst,
        edge=observed.train.edge,
    )
    path, clock = _motion(fit, expected.role)
    if possible(train, path, _WIDTH, clock) <= RIGHT * train.rods.size:
        return 0
    (match,) = align([train], [train.levels], path, _WIDTH, clock)
    return int((match >= 0).sum())


def _motion(fit: Fit, role: str) -> tuple[Trajectory, float]:
    """Path of a side as adjusted, and how slow the clock is."""
    model, x = fit.model, fit.estimate.x
    return model.trajectory(role, x), float(x[model.unknowns["clock"]][0])


def _rods(fit: Fit, role: str, gates: Sequence[_Seen]) -> list[str]:
    """Compare the number of rods that passed with the chain's."""
    chain = fit.model.records[role].chain
    rods = chain.chain.rods
    # Of a rod's two edges one is enough, and counts once.
    expected = _counts([gate.train.rods for gate in gates], rods)
    seen = _counts([gate.train.rods[gate.match >= 0] for gate in gates], rods)
    there = np.flatnonzero(seen)
    missing = rods - 1 - int(there[-1]) if there.size else 0
    if missing and expected[-missing:].min() >= _ENOUGH:
        return [_count(role, chain.name, rods, rods - missing)]
    more = _more(fit, role, gates)
    return [_count(role, chain.name, rods, rods + more)] if more else []


def _counts(passed: Sequence[Index], rods: int) -> Index:
    """How many gates each rod passed, shape ``(rods,)``."""
    sizes = np.array([one.size for one in passed], dtype=np.intp)
    gate = np.repeat(np.arange(len(passed)), sizes)
    places = np.concatenate([*passed, np.zeros(0, dtype=np.intp)]) + gate * rods
    found: Index = (np.bincount(places, minlength=len(passed) * rods) > 0).reshape(-1, rods).sum(0)
    return found


def _count(role: str, name: str, stated: int, found: int) -> str:
    return f"chain {name} on the {role} side has {found} rods, not {stated} as the protocol says"


def _more(fit: Fit, role: str, gates: Sequence[_Seen]) -> int:
    """Count the rods above the top one of the protocol that most gates saw."""
    chain = fit.model.records[role].chain
    places = chain.chain.heights
    enough = max(_ENOUGH, len(gates) / 2)
    # A further rod leaves two edges at each gate, evenly spaced above the top one.
    left = [gate for gate in gates if gate.train.times.size - gate.matched > 1]
    if len(places) < 2 or len(left) < enough:
        return 0
    pitch, width = places[-1] - places[-2], chain.widths[-1]
    path, clock = _motion(fit, role)
    for more in range(1, _MOST + 1):
        trains = [_above(fit, gate, places[-1] + more * pitch, width) for gate in left]
        found = align(trains, [train.levels for train in trains], path, _WIDTH, clock)
        if sum(bool((match >= 0).all()) for match in found) < enough:
            return more - 1
    return _MOST


def _above(fit: Fit, gate: _Seen, place: float, width: float) -> EdgeTrain:
    """What is left of a gate's edges, with one rod expected."""
    left = np.setdiff1d(np.arange(gate.train.times.size), gate.match)
    level = _gate(fit, gate.train).height - place
    return EdgeTrain(
        gate.train.gate,
        gate.train.times[left],
        gate.train.blocked[left],
        gate.train.burst[left],
        gate.train.edge[left],
        np.zeros(2, dtype=np.intp),
        np.array([True, False]),
        np.array([level + width / 2, level - width / 2]),
    )
