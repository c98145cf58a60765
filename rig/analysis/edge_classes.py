"""Every edge that is not as it should be, named one by one.

What an edge is depends on its neighbours: an expected one that nobody reported left no trace, or
drowned in a shadow that ran into the next; a reported one that belongs to no rod is part of a
flicker, a string in a gap, a rod that bounced back, a later passage of what came back, or
unexplained.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from rig.analysis.annealing import MISSED, STRAYS, split
from rig.analysis.chain_records import QUICK
from rig.analysis.later_passages import later_passages
from rig.analysis.plain_data import attributes

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from numpy.typing import NDArray

    from rig.analysis.chain_records import ChainRecord, EdgeTrain
    from rig.analysis.fit import Fit
    from rig.analysis.joint_step import JointDrop
    from rig.analysis.trajectory import Trajectory

    Array = NDArray[np.float64]
    Index = NDArray[np.intp]

EdgeClass = Literal[
    "missed", "merged", "dead gate", "chatter", "string", "bounce", "later passage", "extra"
]
ABSENT = -math.log(MISSED)
"""Cost of an expected edge that did not come: −ln of how probable that is beforehand."""
SURPLUS = -math.log(STRAYS * QUICK)
"""Cost of an edge that belongs to no rod: the same of one within the time of a flicker."""
UNEXPLAINED: EdgeClass = "extra"
"""The class of what nothing explains; ``accept`` of a protocol limits it."""


@dataclass(frozen=True, slots=True)
class UnmatchedEdge:
    """One edge that is missing or belongs to no rod.

    Attributes
    ----------
    kind
        ``missed``: the rod left no trace; ``merged``: its shadow ran into a neighbour's; ``dead
        gate``: nothing came from there. ``chatter``: of a flicker about a rod's edge; ``string``: a
        flicker between rods; ``bounce``: a shadow in the lowest beam after a rod has struck;
        ``later passage``: what had passed came back, and perhaps fell once more; ``extra``: none of
        these, so nothing explains it.
    channel
        Of the gate.
    time_s
        When it came or should have come, s since the release fired.
    blocked
        The state after it.
    rod
        Whose edge it is; `None` for what is no rod.
    edge
        Its number in the drop; `None` for what did not come.
    cost
        What it costs the likelihood: `ABSENT` or `SURPLUS`.
    """

    kind: EdgeClass
    channel: int
    time_s: float
    blocked: bool
    rod: int | None
    edge: int | None
    cost: float

    def json(self) -> dict[str, Any]:
        """One member of ``causes``."""
        return attributes(self, *self.__slots__)


def unmatched_edges(drop: Fit | JointDrop) -> tuple[UnmatchedEdge, ...]:
    """Name everything that is not as it should be, in order of time.

    Parameters
    ----------
    drop
        As adjusted, by itself or with the session.
    """
    model, x = drop.model, drop.x
    assert model.protocol.gates is not None
    clock = model.rate(x)
    found: list[UnmatchedEdge] = []
    for role, record in model.records.items():
        path = model.trajectory(role, x)
        lowest = min(model.protocol.gates.gates[train.gate].height for train in record.trains)
        every = split(model.all_levels(role, x), model.expected[role].ends)
        for train, levels, match in zip(record.trains, every, drop.matches[role], strict=True):
            gate = model.protocol.gates.gates[train.gate]
            if (match < 0).any():
                found += _absent(gate.channel, train, match, path.times(levels) / clock)
            if train.times.size > (match >= 0).sum():
                # Only the lowest beam is near enough to what bounces, and those beside what lies.
                near = gate.height == lowest or record.is_beside_rods(gate)
                after = _first_hit(record, path) / clock if near else np.inf
                back = later_passages(record, train, match, path, model.protocol.gravity.value)
                found += _surplus(gate.channel, train, match, after, back)
    return tuple(sorted(found, key=lambda edge: edge.time_s))


def count_unexplained(unmatched: Iterable[UnmatchedEdge]) -> int:
    """Count the received edges that nothing explains."""
    return sum(edge.kind == UNEXPLAINED for edge in unmatched)


def _first_hit(record: ChainRecord, path: Trajectory) -> float:
    """When the first rod strikes, s; never on the free side."""
    return float(path.time[1]) if record.ratios is not None else np.inf


def _absent(
    channel: int, train: EdgeTrain, match: Index, expected: Array
) -> Iterator[UnmatchedEdge]:
    """Expected edges that nobody reported."""
    for at in np.flatnonzero(match < 0).tolist():
        blocks, when = bool(train.blocks[at]), float(expected[at])
        yield UnmatchedEdge(
            _why(train, when), channel, when, blocks, int(train.rods[at]), None, ABSENT
        )


def _why(train: EdgeTrain, when: float) -> EdgeClass:
    """Say why there is no edge, by the level that the gate kept.

    While a rod leaves no trace the beam stays bright, while a gap leaves none it stays dark.
    """
    if not train.times.size:
        return "dead gate"
    before = int(np.searchsorted(train.times, when))
    dark = bool(train.blocked[before - 1]) if before else False
    return "merged" if dark else "missed"


def _surplus(
    channel: int, train: EdgeTrain, match: Index, hit: float, back: set[int]
) -> Iterator[UnmatchedEdge]:
    """Reported edges that belong to no rod."""
    rods = np.full(train.times.size, -1)
    rods[match[match >= 0]] = train.rods[match >= 0]
    # Edges that follow each other so quickly are of one flicker, and share its number.
    flicker = np.cumsum(np.diff(train.times, prepend=-np.inf) > QUICK)
    for at in np.flatnonzero(rods < 0).tolist():
        when, blocked = float(train.times[at]), bool(train.blocked[at])
        near = rods[(flicker == flicker[at]) & (rods >= 0)]
        kind = UNEXPLAINED
        if near.size:
            kind = "chatter"
        elif train.burst[at] > 0.0:
            kind = "string"
        elif at in back:
            kind = "later passage"
        elif when > hit:
            kind = "bounce"
        rod = int(near[0]) if near.size else None
        yield UnmatchedEdge(kind, channel, when, blocked, rod, int(train.edge[at]), SURPLUS)
