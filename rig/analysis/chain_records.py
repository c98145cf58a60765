"""A drop's edges as times: a train for each gate, a record for each chain.

Beside what each gate reported stands what it should see of the chain that hangs there: down to
where its rods strike the surface, or others that lie there.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.analysis.air import unlike
from rig.analysis.trajectory import ONE
from rig.errors import DomainError
from rig.model.fall import kicks
from rig.model.impact import impact_on
from rig.predictions import air_shares
from rig.protocol.contact import higher_contacts

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from numpy.typing import NDArray

    from rig.arrays import Array, Flags, Index
    from rig.protocol.protocol import Gate, Protocol, RodChain, Run, Side
    from rig.records import Drop


QUICK = 0.3e-3
"""Edges of one gate closer than this are no two sides of a rod: the receiver flickered, s."""
SIDES = 2
"""Edges of a rod, or of one stray pulse."""
LONGEST = 64
"""Edges of one flicker from which on its middle says no more: a clean edge has 1, a rod in front of
a receiver that flickers with the mains some ten. What is fitted takes time with each edge."""

WIDER = 1.2
"""By which a beam may see an object wider or narrower than stated: one that passes half its radius
off the middle of a beam has a chord that is 13 % shorter."""


@dataclass(frozen=True, slots=True)
class EdgeTrain:
    """What one gate reported, and what it should have.

    Attributes
    ----------
    gate
        Number of the gate in the protocol's list.
    times, blocked
        Each edge: seconds since the release fired, and the state after it; shape ``(edges,)``.
    burst
        How long the flicker lasted in which each edge came, s; 0 for a clean edge.
    edge
        Number of each edge in the drop's own list, shape ``(edges,)``.
    rods, blocks
        Each expected edge in order of time: which rod, and whether it darkens the beam; shape
        ``(expected,)``.
    levels
        Height of the chain's reference point at each expected edge by the nominal geometry, m;
        falling.
    thinned
        How many edges more the gate reported, in the middle of flickers of more than `LONGEST`.
    """

    gate: int
    times: Array
    blocked: Flags
    burst: Array
    edge: Index
    rods: Index
    blocks: Flags
    levels: Array
    thinned: int = 0


@dataclass(frozen=True, slots=True)
class EdgeArrays:
    """A drop's edges as arrays, one channel after the other, shape ``(edges,)`` each.

    Of each flicker of more than `LONGEST` edges as many are left, half at either end.

    Attributes
    ----------
    times, channels, blocked
        s, and the state after it.
    burst
        How long the flicker of its gate lasts that each edge is part of, s; 0 if clean.
    numbers
        Of each in the drop.
    received
        Edges by channel, with those that were left out; shape ``(channels,)``.
    """

    times: Array
    channels: Index
    blocked: Flags
    burst: Array
    numbers: Index
    received: Index

    @classmethod
    def of(cls, edges: Sequence[Sequence[int]] | NDArray[np.int64], hz: float) -> EdgeArrays:
        """Take edges whose ticks come at a rate in Hz: tick, channel and state of each."""
        if not isinstance(edges, np.ndarray):
            flat = itertools.chain.from_iterable(edges)  # much faster than an array of rows
            edges = np.fromiter(flat, np.int64, 3 * len(edges)).reshape(-1, 3)
        order = np.argsort(edges[:, 1], kind="stable")
        times, channels = edges[order, 0] / hz, edges[order, 1].astype(np.intp)
        begins = np.diff(times, prepend=-np.inf) > QUICK
        begins |= np.diff(channels, prepend=-1) != 0
        first, flicker = np.flatnonzero(begins), np.cumsum(begins) - 1
        last = np.append(first[1:], times.size)[: first.size] - 1
        place = np.arange(times.size)
        from_end = np.minimum(place - first[flicker], last[flicker] - place)
        spared = np.flatnonzero(from_end < LONGEST // 2)
        return cls(
            times[spared],
            channels[spared],
            edges[order[spared], 2].astype(np.bool_),
            (times[last] - times[first])[flicker[spared]],
            order[spared],
            np.bincount(channels, minlength=1),
        )

    def of_channel(self, channel: int) -> slice:
        """Return where one channel's edges are."""
        return slice(*np.searchsorted(self.channels, [channel, channel + 1]).tolist())

    def count_thinned(self, channel: int) -> int:
        """Count the edges of a channel that were left out."""
        received = int(self.received[channel]) if channel < self.received.size else 0
        return received - int(np.count_nonzero(self.channels == channel))


@dataclass(frozen=True, slots=True)
class ChainRecord:
    """One chain and the gates beside it.

    Attributes
    ----------
    role
        ``impact`` or ``free``.
    chain
        The chain that hangs there.
    trains
        One a gate.
    ratios
        ΔV/V at each impact for α = 1: m/(M + γm) of Eq. 9, shape ``(rods,)``; `None` for a chain
        that strikes nothing.
    alpha
        Of its impacts as the model expects it; 0 for a chain that strikes nothing.
    air
        κ of each leg in units of that of the first chain as a whole, as in
        `rig.analysis.trajectory.Trajectory`.
    unlike
        How much more the air takes from each rod than from its chain, see `rig.analysis.air`.
    incline_deg
        Of the surface that it strikes.
    condition
        Under which it strikes, in words; drops of the same one have the contact in common.
    higher
        How high above the contact point each rod's middle is as its impact pulls, m; not given
        where nothing is struck. Results are at level: the top rod falls on as if nothing lay there.
    aside
        Trains of gates that are left out: so low that not every rod passes them.
    """

    role: Side
    chain: RodChain
    trains: tuple[EdgeTrain, ...]
    ratios: Array | None = None
    alpha: float = 0.0
    air: Array = field(default_factory=lambda: ONE)
    unlike: Array = field(default_factory=lambda: np.zeros(1))
    incline_deg: float = 0.0
    condition: str = ""
    higher: tuple[float, ...] = ()
    aside: tuple[EdgeTrain, ...] = ()

    @property
    def strikes(self) -> Array:
        """How high the reference point is below the contact point as each rod strikes, m."""
        places = np.array(self.chain.chain.heights)
        return places - self.higher if self.higher else places

    @property
    def crossed(self) -> Sequence[float]:
        """Widths of rods where others may be thrown back in their way; else nothing."""
        thrown = self.ratios is not None and self.chain.chain.rods > 1
        return self.chain.widths if thrown else ()

    @property
    def expected(self) -> int:
        """Number of edges that a perfect rig would report."""
        return sum(train.rods.size for train in self.trains)


def edge_train(
    number: int,
    gate: Gate,
    chain: RodChain,
    edges: EdgeArrays,
    start: float,
    higher: tuple[float, ...] | None,
) -> EdgeTrain:
    """Collect what one gate saw and what it should see.

    Parameters
    ----------
    number
        Of the gate in the protocol's list.
    edges
        All edges of the drop.
    start
        Nominal height of the bottom rod's middle before release, m.
    higher
        How far above the contact point each rod ends, m: what passes below that is not expected;
        `None` where nothing is struck.
    """
    at_gate = edges.of_channel(gate.channel)
    # Some timers tell nothing but that beams darken.
    darkening = bool(edges.blocked.size and edges.blocked.all())
    return EdgeTrain(
        number,
        edges.times[at_gate],
        edges.blocked[at_gate],
        edges.burst[at_gate],
        edges.numbers[at_gate],
        *_passages(gate.height, chain, start, higher, darkening),
        edges.count_thinned(gate.channel),
    )


@lru_cache(maxsize=256)  # a session asks for the same few again and again
def _passages(
    height: float,
    chain: RodChain,
    start: float,
    higher: tuple[float, ...] | None,
    darkening: bool,
) -> tuple[Index, Flags, Array]:
    """Rods, polarities and levels of what a beam should see, as `Train` has them."""
    places = np.array(chain.chain.heights)
    widths = np.array(chain.widths)
    # A rod's lower side darkens the beam, its upper side clears it.
    levels = np.stack([height - places + widths / 2, height - places - widths / 2], axis=1).ravel()
    rods = np.repeat(np.arange(places.size), 2)
    blocks = np.tile(np.array([True, False]), places.size)
    seen = (levels < start) & (blocks | (not darkening))
    if higher is not None:
        seen &= levels > (np.array(higher) - places)[rods]
    passages = rods[seen], blocks[seen], levels[seen]
    for values in passages:
        values.flags.writeable = False
    return passages


def thinned(drop: Drop, hz: float) -> Drop:
    """Return a drop without the middles of long flickers, for what reads it many times."""
    numbers = np.sort(EdgeArrays.of(drop.edges, hz).numbers)
    return replace(drop, edges=tuple(drop.edges[n] for n in numbers.tolist()))


def chain_records(
    protocol: Protocol, run: Run, drop: Drop, hz: float, aside: Collection[int] = ()
) -> list[ChainRecord]:
    """Collect each chain with the trains of its gates.

    Parameters
    ----------
    aside
        Numbers of the gates that are left out, in the protocol's list.
    """
    assert protocol.gates is not None
    edges, shares = EdgeArrays.of(drop.edges, hz), air_shares(protocol)
    sides: tuple[tuple[Side, str | None], ...] = (("impact", run.impact), ("free", run.free))
    records = []
    for role, name in sides:
        gates = [(n, gate) for n, gate in enumerate(protocol.gates.gates) if gate.side == role]
        if name is None or not gates:
            continue
        chain, air = protocol.chains[name], np.array(shares[name])
        more, impacts = unlike(chain.chain, shares[name]), _impacts(protocol, run, role, chain)
        higher, start = impacts.get("higher"), protocol.drop.value
        trains = [edge_train(n, gate, chain, edges, start, higher) for n, gate in gates]
        used, unused = (
            tuple(train for train in trains if (train.gate in aside) == left_out)
            for left_out in (False, True)
        )
        # Behind the last leg nothing falls any more, but edges are asked for all the same.
        legs = np.append(air, air[-1]) if impacts and np.ptp(air) else air[:1]
        record = ChainRecord(role, chain, used, air=legs, unlike=more, aside=unused, **impacts)
        records.append(record)
    return records


def _impacts(protocol: Protocol, run: Run, role: Side, chain: RodChain) -> dict[str, Any]:
    """Return what a chain's record has because it strikes; nothing where nothing is struck."""
    if role == "free":
        return {}
    assert protocol.surface is not None
    # γ is the same at every incline, and level ground always in the domain of Eq. 13.
    gamma = impact_on(protocol.surface, chain.chain, 0.0).gamma
    try:
        alpha = impact_on(protocol.surface, chain.chain, run.incline_deg or 0.0).alpha
    except DomainError:
        alpha = 0.0
    return {
        "ratios": np.array(kicks(chain.chain, [1.0] * chain.chain.rods, gamma)),
        "alpha": alpha,
        "incline_deg": run.incline_deg or 0.0,
        "condition": str(protocol.condition(run)),
        "higher": higher_contacts(protocol, run.incline_deg, chain),
    }
