"""A drop's edges as times: a train for each gate, a record for each chain.

Beside what each gate reported stands what it should see of the chain that hangs there.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Literal

import numpy as np

from rig.analysis.heap import strike_heights
from rig.analysis.trajectory import ONE
from rig.errors import DomainError
from rig.model.fall import kicks
from rig.model.impact import impact_on
from rig.model.rods import rod_impacts
from rig.predictions import air_shares
from rig.protocol.contact import higher_contacts

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from rig.model.chain import Chain
    from rig.protocol.protocol import Gate, Protocol, RodChain, Run
    from rig.records import Drop

    Array = NDArray[np.float64]
    Flags = NDArray[np.bool_]
    Index = NDArray[np.intp]


QUICK = 0.3e-3
"""Edges of one gate closer than this are no two sides of a rod: the receiver flickered, s."""
LONGEST = 64
"""Edges of one flicker from which on its middle says no more: a clean edge has 1, a rod in front of
a receiver that flickers with the mains some ten. What is fitted takes time with each edge."""


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


@dataclass(frozen=True)
class EdgeArrays:
    """A drop's edges as arrays, shape ``(edges,)`` each.

    Attributes
    ----------
    whole
        Those of which these were left, see `thinned`; `None` where these are all.
    numbers
        Of each among all.
    """

    times: Array
    channels: Index
    blocked: Flags
    whole: EdgeArrays | None = None
    numbers: Index = field(default_factory=lambda: np.zeros(0, dtype=np.intp))

    @cached_property
    def darkening(self) -> bool:
        """Whether beams only ever darken: some timers tell nothing else."""
        return bool(self.blocked.size and self.blocked.all())

    @cached_property
    def order(self) -> Index:
        """Edges of one channel after the other."""
        return np.argsort(self.channels, kind="stable")

    def of_channel(self, channel: int) -> Index:
        """Return the numbers of one channel's edges."""
        begin, end = np.searchsorted(self._ordered, [channel, channel + 1])
        return self.order[begin:end]

    @cached_property
    def _ordered(self) -> Index:
        return self.channels[self.order]

    @cached_property
    def _flickers(self) -> tuple[Index, Index]:
        """First and last place of each flicker in `order`; a clean edge is one by itself."""
        apart = (np.diff(self.times[self.order]) > QUICK) | (np.diff(self._ordered) != 0)
        edge = np.ones(min(1, self.times.size), dtype=np.bool_)
        begins, ends = np.concatenate([edge, apart]), np.concatenate([apart, edge])
        return np.flatnonzero(begins), np.flatnonzero(ends)

    @cached_property
    def burst(self) -> Array:
        """How long the flicker of its gate lasts that each edge is part of, s; 0 if clean."""
        if self.whole is not None:
            return self.whole.burst[self.numbers]
        first, last = self._flickers
        times = self.times[self.order]
        found = np.empty_like(times)
        found[self.order] = np.repeat(times[last] - times[first], last - first + 1)
        return found

    def thinned(self) -> EdgeArrays:
        """Leave of each flicker of more than `LONGEST` edges as many, half at either end."""
        first, last = self._flickers
        size = last - first + 1
        if not size.size or size.max() <= LONGEST:
            return self
        place = np.arange(self.times.size)
        since, until = place - np.repeat(first, size), np.repeat(last, size) - place
        ends = np.minimum(since, until) < LONGEST // 2
        left = np.sort(self.order[ends])
        parts = self.times[left], self.channels[left], self.blocked[left]
        return EdgeArrays(*parts, self, left)

    def count_thinned(self, channel: int) -> int:
        """Count the edges of a channel that were left out."""
        if self.whole is None:
            return 0
        return self.whole.of_channel(channel).size - self.of_channel(channel).size

    @classmethod
    def of(cls, drop: Drop, hz: float) -> EdgeArrays:
        """Take them from a drop whose ticks come at a rate in Hz, thinned."""
        flat = itertools.chain.from_iterable(drop.edges)  # much faster than an array of rows
        table = np.fromiter(flat, np.int64, 3 * len(drop.edges)).reshape(-1, 3)
        times, channels, blocked = table[:, 0] / hz, table[:, 1], table[:, 2]
        return cls(times, channels.astype(np.intp), blocked.astype(np.bool_)).thinned()


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
    condition
        Under which it strikes, in words; drops of the same one have the contact in common.
    higher
        How high above the contact point each rod's middle is as its impact pulls, m; not given
        where nothing is struck. Results are at level: the top rod falls on as if nothing lay there.
    clear
        Above which height of its middle nothing lies in each rod's way, m; as `higher` where
        nothing does.
    """

    role: Literal["impact", "free"]
    chain: RodChain
    trains: tuple[EdgeTrain, ...]
    ratios: Array | None = None
    alpha: float = 0.0
    air: Array = field(default_factory=lambda: ONE)
    condition: str = ""
    higher: tuple[float, ...] = ()
    clear: tuple[float, ...] = ()

    @property
    def strikes(self) -> Array:
        """How high the reference point is below the contact point as each rod strikes, m."""
        places = np.array(self.chain.chain.heights)
        return places - self.higher if self.higher else places

    @property
    def is_on_heap(self) -> bool:
        """Whether rods strike others that lie there."""
        return self.clear != self.higher

    def is_beside_rods(self, gate: Gate) -> bool:
        """Whether others may lie in a gate's beam as one of the rods passes it."""
        return self.is_on_heap and gate.height < max(self.clear) + 0.5 * max(self.chain.widths)

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
    mine = edges.of_channel(gate.channel)
    rods, blocks, levels = _passages(gate.height, chain, start, higher, edges.darkening)
    return EdgeTrain(
        number,
        edges.times[mine],
        edges.blocked[mine],
        edges.burst[mine],
        mine if edges.whole is None else edges.numbers[mine],
        rods,
        blocks,
        levels,
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
    seen = levels < start
    if higher is not None:
        seen &= levels > (np.array(higher) - places)[rods]
    if darkening:
        seen &= blocks
    found = rods[seen], blocks[seen], levels[seen]
    for one in found:
        one.flags.writeable = False
    return found


def thinned(drop: Drop, hz: float) -> Drop:
    """Return a drop without the middles of long flickers, for what reads it many times."""
    edges = EdgeArrays.of(drop, hz)
    if edges.whole is None:
        return drop
    return replace(drop, edges=tuple(drop.edges[n] for n in edges.numbers.tolist()))


def chain_records(protocol: Protocol, run: Run, drop: Drop, hz: float) -> list[ChainRecord]:
    """Collect each chain with the trains of its gates."""
    found = []
    shares = air_shares(protocol)
    for role, chain, trains in edge_trains(protocol, run, EdgeArrays.of(drop, hz)):
        air = np.array(shares[chain.name])
        if role == "free":
            found.append(ChainRecord(role, chain, trains, air=air[:1]))
        else:
            ratios, alpha = _ratios(protocol, chain.chain), _alpha(protocol, chain, run)
            # Behind the last leg nothing falls any more, but edges are asked for all the same.
            air = np.append(air, air[-1]) if np.ptp(air) else air[:1]
            where = str(protocol.condition(run))
            higher, clear = _contacts(protocol, run, chain)
            found.append(ChainRecord(role, chain, trains, ratios, alpha, air, where, higher, clear))
    return found


def edge_trains(
    protocol: Protocol, run: Run, edges: EdgeArrays
) -> Iterator[tuple[Literal["impact", "free"], RodChain, tuple[EdgeTrain, ...]]]:
    """Sort edges by side: its role, the chain that hung there, and the train of each of its gates.

    A side where nothing hung, or without gates, is left out.
    """
    assert protocol.gates is not None
    start = protocol.drop.value
    for role in ("impact", "free"):
        name = run.impact if role == "impact" else run.free
        gates = [(n, gate) for n, gate in enumerate(protocol.gates.gates) if gate.side == role]
        if name is None or not gates:
            continue
        chain = protocol.chains[name]
        clear = None
        if role == "impact":
            clear = _contacts(protocol, run, chain)[1]
        trains = (edge_train(n, gate, chain, edges, start, clear) for n, gate in gates)
        yield role, chain, tuple(trains)


def _contacts(
    protocol: Protocol, run: Run, chain: RodChain
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return `ChainRecord.higher` and `ChainRecord.clear`."""
    if not protocol.contact.heaped or protocol.surface is None:
        higher = higher_contacts(protocol, run.incline_deg, chain)
        return higher, higher
    heights = strike_heights(protocol.surface, run.incline_deg, chain)
    return (*heights[:-1], 0.0), tuple(z + protocol.contact.strike.u for z in heights)


def _ratios(protocol: Protocol, chain: Chain) -> Array:
    """ΔV/V of each impact for α = 1, Eq. 9."""
    assert protocol.surface is not None
    # γ is the same at every incline, and level ground is always inside the domain of Eq. 13.
    gammas = [impact.gamma for impact in rod_impacts(protocol.surface, chain, 0.0)]
    return np.array(kicks(chain, [1.0] * chain.rods, gammas))


def _alpha(protocol: Protocol, chain: RodChain, run: Run) -> float:
    """α that the model expects, all rods taken together; 0 where it has none."""
    assert protocol.surface is not None
    try:
        return impact_on(protocol.surface, chain.chain, run.incline_deg or 0.0).alpha
    except DomainError:
        return 0.0
