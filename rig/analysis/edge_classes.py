"""Classification of unmatched edges.

The class of an edge depends on its neighbours. An expected edge without a match was missed, or its
shadow merged with the next. An observed edge without a rod is part of a flicker, a string in a gap,
a rebounding rod, a later passage of the object, or unexplained.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from rig.analysis.annealing import STRAYS
from rig.analysis.chain_records import QUICK, WIDER, ChainRecord
from rig.analysis.fit import Fit
from rig.analysis.joint_step import JointDrop
from rig.analysis.trajectory import Trajectory
from rig.arrays import Array, Flags, Index
from rig.plain_data import attributes
from rig.protocol.protocol import Protocol

EdgeClass = Literal[
    "missed",
    "merged",
    "dead gate",
    "chatter",
    "string",
    "bounce",
    "later passage",
    "struck",
    "left out",
    "extra",
]
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
        ``missed``: no edge of the rod; ``struck``: rather, it has struck before, on a heap, or rods
        that lie there darken the beam; ``merged``: its shadow overlaps a neighbour's; ``dead
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
        Cost in the log likelihood: −ln of its prior probability; 0 if the gate is left out.
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
    unmatched: list[UnmatchedEdge] = []
    for role, record in model.records.items():
        match, path, clock = drop.matches[role], model.trajectory(role, x), model.rate(x)
        if (match < 0).any():
            due = path.times(model.all_levels(role, x)) / clock
            unmatched += _absent(model.protocol, record, match, due)
        if record.edges.times.size > (match >= 0).sum():
            unmatched += _surplus(model.protocol, record, match, path, clock)
    return tuple(sorted(unmatched, key=lambda edge: edge.time_s))


def _absent(
    protocol: Protocol, record: ChainRecord, match: Index, due: Array
) -> Iterator[UnmatchedEdge]:
    """Yield the missing edges of a chain, with classes from the state of their beams.

    If a rod is missed the beam stays bright; if a gap between rods is missed it stays dark.
    """
    edges, (rods, blocks, _, gates, absent), blame = record.edges, record.due, record.due.blame
    for at in np.flatnonzero(match < 0).tolist():
        before = edges.blocked[(edges.gate == gates[at]) & (edges.times < due[at])]
        kind: EdgeClass = "merged" if before[-1:].any() else "missed"
        kind = kind if blame[at] > 0.5 else "struck"
        kind = kind if gates[at] in edges.gate else "dead gate"
        channel, when = protocol.gates.gates[gates[at]].channel, float(due[at])
        cost = -math.log(absent[at])
        yield UnmatchedEdge(kind, channel, when, bool(blocks[at]), int(rods[at]), None, cost)


def _surplus(
    protocol: Protocol, record: ChainRecord, match: Index, path: Trajectory, clock: Array
) -> Iterator[UnmatchedEdge]:
    """Yield the observed edges of a chain that belong to no rod, with the first class that holds.

    Chatter comes before all others: an edge in the same flicker as that of a rod.
    """
    gates, edges = protocol.gates.gates, record.edges
    rods = np.full(edges.times.size, -1)
    rods[match[match >= 0]] = record.due.rods[match >= 0]
    # Edges within `QUICK` of each other belong to the same flicker, and share its number.
    is_new = np.diff(edges.gate, prepend=-1) > 0
    flicker = np.cumsum(is_new | (np.diff(edges.times, prepend=-np.inf) > QUICK))
    classes: dict[EdgeClass, Flags] = {"left out": np.isin(edges.gate, record.aside)}
    classes["string"] = edges.burst > 0.0
    if record.ratios is not None:
        # Only the lowest beam is within reach of rebounding rods.
        heights = np.array([gate.height for gate in gates])
        is_low = heights[edges.gate] == heights[record.due.gate].min()
        classes["bounce"] = is_low & (edges.times > float(path.time[1]) / clock)
    elif record.chain.chain.rods == 1:
        gravity = protocol.gravity.value
        classes["later passage"] = _later_passages(record, rods >= 0, path, gravity)
    for at in np.flatnonzero(rods < 0).tolist():
        near = rods[(flicker == flicker[at]) & (rods >= 0)]
        kind = next((kind for kind, holds in classes.items() if holds[at]), UNEXPLAINED)
        kind, rod = ("chatter", int(near[0])) if near.size else (kind, None)
        when, blocked, edge = float(edges.times[at]), bool(edges.blocked[at]), int(edges.number[at])
        cost, channel = 0.0 if kind == "left out" else SURPLUS, gates[edges.gate[at]].channel
        yield UnmatchedEdge(kind, channel, when, blocked, rod, edge, cost)


def _later_passages(record: ChainRecord, seen: Flags, path: Trajectory, gravity: float) -> Flags:
    """Return which edges are a single object's later passages of a gate after it rebounded.

    The object rises through a gate and falls through it again, with at most the energy of its first
    passage at speed v. So each shadow lasts at least width/v, and the second of a pair follows the
    first within the flight time 2v/g. Neither holds for a pendulum, whose half period is longer,
    nor for edges of lower gates on the same channel. The last shadow may be single: the object
    turned in the beam, or the recording ended. Of a chain, surplus rods would look alike.

    Parameters
    ----------
    seen
        Whether each edge is matched.
    """
    back = np.zeros(seen.size, dtype=np.bool_)
    for gate in {*record.edges.gate[seen].tolist()}:
        here = np.flatnonzero(record.edges.gate == gate)
        here = here[np.flatnonzero(seen[here])[-1] :]  # the last matched edge, and later ones
        times, dark = record.edges.times[here], record.edges.blocked[here]
        speed = float(path.heights(times[:1])[1][0])
        begins = ends = np.arange(1, times.size)
        if not record.edges.blocked.all():  # else the timer records no ends of shadows
            # Each shadow begins as the beam darkens and ends with the next edge.
            shadow = dark[:-1] & ~dark[1:]
            shadow &= np.diff(times) * speed * WIDER >= min(record.chain.widths)
            begins = 1 + np.flatnonzero(shadow[1:])
            ends = begins + 1
        paired = times[begins[1:]] - times[ends[:-1]] < 2.0 * speed * WIDER / gravity
        later = np.append(paired, True) | np.append(False, paired)
        back[here[begins]] = back[here[ends]] = later
    return back
