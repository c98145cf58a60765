"""Classification of unmatched edges.

The class of an edge depends on its neighbours. An expected edge without a match was missed, or its
shadow merged with the next. An observed edge without a rod is part of a flicker, a string in a gap,
a rebounding rod, a later passage of the object, or unexplained.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from rig.analysis.annealing import MISSED, STRAYS
from rig.analysis.chain_records import QUICK, WIDER, ChainRecord, EdgeTrain
from rig.analysis.fit import Fit
from rig.analysis.joint_step import JointDrop
from rig.analysis.plain_data import attributes
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
"""Cost of a missed edge: −ln of its prior probability."""
SURPLUS = -math.log(STRAYS * QUICK)
"""Cost of a stray edge: −ln of its prior probability within the time of a flicker."""
UNEXPLAINED: EdgeClass = "extra"
"""Class of unexplained edges; ``accept`` of a protocol limits their share."""


@dataclass(frozen=True, slots=True)
class UnmatchedEdge:
    """An edge that is missing or belongs to no rod.

    Attributes
    ----------
    kind
        ``missed``: no edge of the rod; ``merged``: its shadow overlaps a neighbour's; ``dead
        gate``: the gate gave no edges. ``chatter``: flicker about a rod's edge; ``string``: flicker
        between rods; ``bounce``: shadow in the lowest beam after a rod has struck; ``later
        passage``: the object came back, and perhaps fell again; ``left out``: edge of a gate that
        not every rod passes; ``extra``: none of these, unexplained.
    channel
        Channel of the gate.
    time_s
        Observed or expected time, s since the release fired.
    blocked
        State after the edge.
    rod
        Rod of the edge; `None` if it belongs to no rod.
    edge
        Its number in the drop; `None` for an edge that was not observed.
    cost
        Cost in the log likelihood: `ABSENT` or `SURPLUS`; 0 if the gate is left out.
    """

    kind: EdgeClass
    channel: int
    time_s: float
    blocked: bool
    rod: int | None
    edge: int | None
    cost: float

    def json(self) -> dict[str, Any]:
        """Return a member of ``causes``."""
        return attributes(self, *self.__slots__)


def unmatched_edges(drop: Fit | JointDrop) -> tuple[UnmatchedEdge, ...]:
    """Return all missing and surplus edges of a drop with their classes, in order of time.

    Parameters
    ----------
    drop
        Fitted drop, by itself or with the session.
    """
    model, x = drop.model, drop.x
    assert model.protocol.gates is not None
    clock, gates = model.rate(x), model.protocol.gates.gates
    unmatched: list[UnmatchedEdge] = []
    for role, record in model.records.items():
        path = model.trajectory(role, x)
        lowest = min(gates[train.gate].height for train in record.trains)
        due = path.times(model.all_levels(role, x)) / clock
        for train, expected, match in record.by_gate(drop.matches[role]):
            gate = gates[train.gate]
            # Only the lowest beam is within reach of rebounding rods.
            near = gate.height == lowest and record.ratios is not None
            hit = float(path.time[1]) / clock if near else np.inf
            if (match < 0).any():
                unmatched += _absent(gate.channel, train, match, due[expected])
            if train.times.size > (match >= 0).sum():
                back = later_passages(record, train, match, path, model.protocol.gravity.value)
                unmatched += _surplus(gate.channel, train, match, hit, back)
        for train in record.aside:
            channel, edges = gates[train.gate].channel, range(train.times.size)
            unmatched += [_received_edge("left out", channel, train, at, None, 0.0) for at in edges]
    return tuple(sorted(unmatched, key=lambda edge: edge.time_s))


def count_unexplained(unmatched: Iterable[UnmatchedEdge]) -> int:
    """Return the number of unexplained edges."""
    return sum(edge.kind == UNEXPLAINED for edge in unmatched)


def _absent(
    channel: int, train: EdgeTrain, match: Index, expected: Array
) -> Iterator[UnmatchedEdge]:
    """Yield the missing edges of a gate, with classes from the state of its beam.

    If a rod is missed the beam stays bright; if a gap between rods is missed it stays dark.
    """
    for at in np.flatnonzero(match < 0).tolist():
        when, before = float(expected[at]), int(np.searchsorted(train.times, expected[at]))
        kind: EdgeClass = "merged" if before and train.blocked[before - 1] else "missed"
        kind = kind if train.times.size else "dead gate"
        blocks, rod = bool(train.blocks[at]), int(train.rods[at])
        yield UnmatchedEdge(kind, channel, when, blocks, rod, None, ABSENT)


def _received_edge(
    kind: EdgeClass, channel: int, train: EdgeTrain, at: int, rod: int | None, cost: float = SURPLUS
) -> UnmatchedEdge:
    """Return the unmatched edge for number `at` of a train."""
    when, blocked, edge = float(train.times[at]), bool(train.blocked[at]), int(train.edge[at])
    return UnmatchedEdge(kind, channel, when, blocked, rod, edge, cost)


def _surplus(
    channel: int, train: EdgeTrain, match: Index, hit: float, back: set[int]
) -> Iterator[UnmatchedEdge]:
    """Yield the observed edges of a gate that belong to no rod."""
    rods = np.full(train.times.size, -1)
    rods[match[match >= 0]] = train.rods[match >= 0]
    # Edges within `QUICK` of each other belong to the same flicker, and share its number.
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
        yield _received_edge(kind, channel, train, at, int(near[0]) if near.size else None)


def later_passages(
    record: ChainRecord, train: EdgeTrain, match: Index, path: Trajectory, gravity: float
) -> set[int]:
    """Return the edges of a single object's later passages of a gate after it rebounded.

    The object rises through a gate and falls through it again, with at most the energy of its first
    passage at speed v. So each shadow lasts at least width/v, and the second of a pair follows the
    first within the flight time 2v/g. Neither holds for a pendulum, whose half period is longer,
    nor for edges of lower gates on the same channel. The last shadow may be single: the object
    turned in the beam, or the recording ended.

    Parameters
    ----------
    record, train, match
        The chain, a gate of it, and its observed edge for every expected edge (−1: none).
    path
        Trajectory of the chain.
    gravity
        Acceleration of a free fall, or down the track, m/s².

    Returns
    -------
    set of int
        Numbers of the edges in the train; empty for a chain, where surplus rods would look alike.
    """
    if record.ratios is not None or record.chain.chain.rods > 1 or not (match >= 0).any():
        return set()
    times, later = train.times, np.arange(int(match.max()) + 1, train.times.size)
    speed = float(path.heights(times[[match.max()]])[1][0])
    if train.blocked.all():  # the timer records no ends of shadows
        begins = ends = later
    else:
        # Each shadow begins as the beam darkens and ends with the next edge.
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
