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
from rig.analysis.chain_records import QUICK, WIDER
from rig.analysis.plain_data import attributes

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from rig.analysis.chain_records import ChainRecord, EdgeTrain
    from rig.analysis.fit import Fit
    from rig.analysis.joint_step import JointDrop
    from rig.analysis.trajectory import Trajectory
    from rig.arrays import Array, Index


EdgeClass = Literal[
    "missed",
    "merged",
    "dead gate",
    "chatter",
    "string",
    "bounce",
    "later passage",
    "left out",
    "extra",
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
        ``later passage``: what had passed came back, and perhaps fell once more; ``left out``: of a
        gate that not every rod passes; ``extra``: none of these, so nothing explains it.
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
        What it costs the likelihood: `ABSENT` or `SURPLUS`; nothing where the gate is left out.
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
    clock, gates = model.rate(x), model.protocol.gates.gates
    unmatched: list[UnmatchedEdge] = []
    for role, record in model.records.items():
        path = model.trajectory(role, x)
        lowest = min(gates[train.gate].height for train in record.trains)
        by_gate = split(model.all_levels(role, x), model.expected[role].ends)
        for train, levels, match in zip(record.trains, by_gate, drop.matches[role], strict=True):
            gate = gates[train.gate]
            # Only the lowest beam is near enough to what bounces.
            near = gate.height == lowest and record.ratios is not None
            hit = float(path.time[1]) / clock if near else np.inf
            if (match < 0).any():
                unmatched += _absent(gate.channel, train, match, path.times(levels) / clock)
            if train.times.size > (match >= 0).sum():
                back = later_passages(record, train, match, path, model.protocol.gravity.value)
                unmatched += _surplus(gate.channel, train, match, hit, back)
        for train in record.aside:
            channel, edges = gates[train.gate].channel, range(train.times.size)
            unmatched += [_received("left out", channel, train, at, None, 0.0) for at in edges]
    return tuple(sorted(unmatched, key=lambda edge: edge.time_s))


def count_unexplained(unmatched: Iterable[UnmatchedEdge]) -> int:
    """Count the received edges that nothing explains."""
    return sum(edge.kind == UNEXPLAINED for edge in unmatched)


def _absent(
    channel: int, train: EdgeTrain, match: Index, expected: Array
) -> Iterator[UnmatchedEdge]:
    """Expected edges that nobody reported, explained by the level that the gate kept.

    While a rod leaves no trace the beam stays bright, while a gap leaves none it stays dark.
    """
    for at in np.flatnonzero(match < 0).tolist():
        when, before = float(expected[at]), int(np.searchsorted(train.times, expected[at]))
        kind: EdgeClass = "merged" if before and train.blocked[before - 1] else "missed"
        kind = kind if train.times.size else "dead gate"
        blocks, rod = bool(train.blocks[at]), int(train.rods[at])
        yield UnmatchedEdge(kind, channel, when, blocks, rod, None, ABSENT)


def _received(
    kind: EdgeClass, channel: int, train: EdgeTrain, at: int, rod: int | None, cost: float = SURPLUS
) -> UnmatchedEdge:
    """Name one edge of a train, by its number there."""
    when, blocked, edge = float(train.times[at]), bool(train.blocked[at]), int(train.edge[at])
    return UnmatchedEdge(kind, channel, when, blocked, rod, edge, cost)


def _surplus(
    channel: int, train: EdgeTrain, match: Index, hit: float, back: set[int]
) -> Iterator[UnmatchedEdge]:
    """Reported edges that belong to no rod."""
    rods = np.full(train.times.size, -1)
    rods[match[match >= 0]] = train.rods[match >= 0]
    # Edges that follow each other so quickly are of one flicker, and share its number.
    flicker = np.cumsum(np.diff(train.times, prepend=-np.inf) > QUICK)
    for at in np.flatnonzero(rods < 0).tolist():
        near = rods[(flicker == flicker[at]) & (rods >= 0)]
        kinds: dict[EdgeClass, bool] = {
            "chatter": bool(near.size),
            "string": bool(train.burst[at] > 0.0),
            "later passage": at in back,
            "bounce": bool(train.times[at] > hit),
        }
        kind = next((kind for kind, holds in kinds.items() if holds), UNEXPLAINED)
        yield _received(kind, channel, train, at, int(near[0]) if near.size else None)


def later_passages(
    record: ChainRecord, train: EdgeTrain, match: Index, path: Trajectory, gravity: float
) -> set[int]:
    """Find the edges of what came back after it had passed a gate, and perhaps fell once more.

    It rises through a gate and falls through it again, with at most the energy with which it first
    passed at speed v. So each shadow lasts at least width/v, and the second of a pair follows the
    first within the flight 2v/g. Neither holds for a pendulum, whose half period is longer than
    that, nor for edges of lower gates on the same channel. The last shadow may stand alone: of a
    turn in the beam, or because the recording ends.

    Parameters
    ----------
    record, train, match
        The chain, one of its gates, and which of its edges is which expected one (-1: none).
    path
        The chain's motion.
    gravity
        Acceleration of a free fall, or down the track, m/s².

    Returns
    -------
    set of int
        Numbers of the edges in the train; empty for a chain, whose rods too many would look alike.
    """
    if record.ratios is not None or record.chain.chain.rods > 1 or not (match >= 0).any():
        return set()
    times, later = train.times, np.arange(int(match.max()) + 1, train.times.size)
    speed = float(path.heights(times[[match.max()]])[1][0])
    if train.blocked.all():  # a timer that tells no ends of shadows
        begins = ends = later
    else:
        # Each shadow begins as the beam darkens and ends with the very next edge.
        begins = later[:-1][train.blocked[later[:-1]] & ~train.blocked[later[1:]]]
        slow = np.diff(times)[begins] * speed * WIDER >= min(record.chain.widths)
        begins = begins[slow]
        ends = begins + 1
    flight = 2.0 * speed * WIDER / gravity
    back: set[int] = set()
    at = 0
    while at < begins.size:
        pair = at + 1 < begins.size and times[begins[at + 1]] - times[ends[at]] < flight
        if pair or at + 1 == begins.size:
            shadows = slice(at, at + 1 + pair)
            back |= {*begins[shadows].tolist(), *ends[shadows].tolist()}
        at += 1 + pair
    return back
