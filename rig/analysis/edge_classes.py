"""Classification of unmatched edges.

The class of an edge depends on its neighbours. An expected edge without a match was missed, or its
shadow merged with the next. An observed edge without a rod is part of a flicker, a string in a gap,
a rebounding rod, a later passage of the object, or unexplained.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from rig.analysis.annealing import MISSED, STRAYS
from rig.analysis.chain_records import QUICK, WIDER, ChainRecord, EdgeTrain
from rig.analysis.fit import Fit
from rig.analysis.joint_step import JointDrop
from rig.analysis.trajectory import Trajectory
from rig.arrays import Array, Flags, Index
from rig.plain_data import attributes

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
    clock, gates, gravity = model.rate(x), model.protocol.gates.gates, model.protocol.gravity.value
    unmatched: list[UnmatchedEdge] = []
    for role, record in model.records.items():
        path, none = model.trajectory(role, x), np.zeros(0, dtype=np.intp)
        lowest = min(gates[train.gate].height for train in record.trains)
        due = path.times(model.all_levels(role, x)) / clock
        for train, expected, match in record.by_gate(drop.matches[role]):
            gate = gates[train.gate]
            if (match < 0).any():
                unmatched += _absent(gate.channel, train, match, due[expected])
            if train.times.size > (match >= 0).sum():
                # Only the lowest beam is within reach of rebounding rods.
                near = gate.height == lowest and record.ratios is not None
                classes: dict[EdgeClass, Flags] = {
                    "string": train.burst > 0.0,
                    "later passage": _later_passages(record, train, match, path, gravity),
                    "bounce": train.times > (float(path.time[1]) / clock if near else np.inf),
                }
                unmatched += _surplus(gate.channel, train, match, classes)
        for train in record.aside:
            classes = {"left out": train.burst >= 0.0}
            unmatched += _surplus(gates[train.gate].channel, train, none, classes)
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
    # Before the first edge, the place −1 is that of a bright beam.
    dark = np.append(train.blocked, False)[np.searchsorted(train.times, expected) - 1]
    for at in np.flatnonzero(match < 0).tolist():
        kind: EdgeClass = "merged" if dark[at] else "missed" if train.times.size else "dead gate"
        blocks, rod = bool(train.blocks[at]), int(train.rods[at])
        yield UnmatchedEdge(kind, channel, float(expected[at]), blocks, rod, None, ABSENT)


def _surplus(
    channel: int, train: EdgeTrain, match: Index, classes: Mapping[EdgeClass, Flags]
) -> Iterator[UnmatchedEdge]:
    """Yield the observed edges of a gate that belong to no rod, with the first class that holds.

    Chatter comes before all others: an edge in the same flicker as that of a rod.
    """
    rods = np.full(train.times.size, -1)
    rods[match[match >= 0]] = train.rods[: match.size][match >= 0]
    # Edges within `QUICK` of each other belong to the same flicker, and share its number.
    flicker = np.cumsum(np.diff(train.times, prepend=-np.inf) > QUICK)
    for at in np.flatnonzero(rods < 0).tolist():
        near = rods[(flicker == flicker[at]) & (rods >= 0)]
        kind = next((kind for kind, holds in classes.items() if holds[at]), UNEXPLAINED)
        kind, rod = ("chatter", int(near[0])) if near.size else (kind, None)
        when, blocked, edge = float(train.times[at]), bool(train.blocked[at]), int(train.edge[at])
        cost = 0.0 if kind == "left out" else SURPLUS
        yield UnmatchedEdge(kind, channel, when, blocked, rod, edge, cost)


def _later_passages(
    record: ChainRecord, train: EdgeTrain, match: Index, path: Trajectory, gravity: float
) -> Flags:
    """Return which edges are a single object's later passages of a gate after it rebounded.

    The object rises through a gate and falls through it again, with at most the energy of its first
    passage at speed v. So each shadow lasts at least width/v, and the second of a pair follows the
    first within the flight time 2v/g. Neither holds for a pendulum, whose half period is longer,
    nor for edges of lower gates on the same channel. The last shadow may be single: the object
    turned in the beam, or the recording ended. Of a chain, surplus rods would look alike.
    """
    times, dark, back = train.times, train.blocked, np.zeros(train.times.size, dtype=np.bool_)
    if record.ratios is not None or record.chain.chain.rods > 1 or not (match >= 0).any():
        return back
    first, speed = match.max(), float(path.heights(times[[match.max()]])[1][0])
    begins = ends = np.arange(first + 1, times.size)
    if not dark.all():  # else the timer records no ends of shadows
        # Each shadow begins as the beam darkens and ends with the next edge.
        shadow = (
            dark[:-1] & ~dark[1:] & (np.diff(times) * speed * WIDER >= min(record.chain.widths))
        )
        begins = begins[:-1][shadow[first + 1 :]]
        ends = begins + 1
    paired = times[begins[1:]] - times[ends[:-1]] < 2.0 * speed * WIDER / gravity
    back[begins] = back[ends] = np.append(paired, True) | np.append(False, paired)
    return back
