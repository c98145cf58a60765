"""A drop's edges as times: a train for each gate, a record for each chain.

Beside the observed edges of a gate stand the expected ones: all rods' sides that pass the beam
before the rod strikes the surface, or rods that lie on it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.analysis.trajectory import ONE
from rig.arrays import Array, Flags, Index
from rig.errors import DomainError
from rig.model.chain import Chain
from rig.model.fall import kicks
from rig.model.impact import impact_on
from rig.predictions import air_shares
from rig.protocol.contact import higher_contacts
from rig.protocol.protocol import Gate, Protocol, RodChain, Run, Side
from rig.records import Drop

QUICK = 0.3e-3
"""Edges of a gate closer than this are a flicker of the receiver, not two sides of a rod, s."""
SIDES = 2
"""Number of edges of a rod, or of a stray pulse."""
LONGEST = 64
"""Most edges kept of a flicker, to save time: its middle adds no information. A clean edge has 1,
a rod in front of a receiver that flickers with the mains about ten."""

_ON_RODS = 2.0
"""`ChainRecord.uneven` on a pile: in resolved falls, α of single impulses scatters by 0.04 there
and by 0.02 on a board."""
WIDER = 1.2
"""Factor by which an object's width in a beam may differ from the stated one: if the beam passes
half a radius off its middle, the chord is 13 % shorter."""


@dataclass(frozen=True, slots=True)
class EdgeTrain:
    """Observed and expected edges of a gate.

    Attributes
    ----------
    gate
        Number of the gate in the protocol's list.
    times, blocked
        Each edge: seconds since the release fired, and the state after it; shape ``(edges,)``.
    burst
        Duration of the flicker that each edge is part of, s; 0 for a clean edge.
    edge
        Number of each edge in the drop's own list, shape ``(edges,)``.
    rods, blocks
        Each expected edge in order of time: which rod, and whether it darkens the beam; shape
        ``(expected,)``.
    levels
        Height of the chain's reference point at each expected edge by the nominal geometry, m;
        falling.
    thinned
        Number of observed edges left out, from the middle of flickers longer than `LONGEST`.
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

    Of a flicker of more than `LONGEST` edges that many are kept, half at either end.

    Attributes
    ----------
    times, channels, blocked
        Time, s, gate channel, and state after the edge.
    burst
        Duration of the flicker that each edge is part of, s; 0 if clean.
    numbers
        Number of each edge in the drop.
    received
        Number of edges by channel, including those left out; shape ``(channels,)``.
    """

    times: Array
    channels: Index
    blocked: Flags
    burst: Array
    numbers: Index
    received: Index

    @classmethod
    def of(cls, edges: Sequence[Sequence[int]] | NDArray[np.int64], hz: float) -> EdgeArrays:
        """Return arrays of edges given as rows of tick, channel and state; `hz` in ticks/s."""
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
        A train for each gate.
    ratios
        ΔV/V at each impact for α = 1: m/(M + γm) of Eq. 9, shape ``(rods,)``; `None` for a free
        chain.
    alpha
        α that the model predicts for its impacts; 0 for a free chain.
    air
        κ of each leg in units of that of the first chain as a whole, as in
        `rig.analysis.trajectory.Trajectory`.
    unlike
        κ of each rod alone less that of its chain, see `unlike`.
    uneven
        Scatter of its single impulses relative to that on a bare board.
    incline_deg
        Inclination of the surface that it strikes.
    condition
        Name of the condition; drops under the same condition share the contact unknowns.
    higher
        Height of each rod's middle above the contact point as its impact acts, m; empty for a free
        chain. Results refer to the level: the top rod falls on as if no rod lay there.
    aside
        Trains of gates that are left out, too low for every rod to pass.
    """

    role: Side
    chain: RodChain
    trains: tuple[EdgeTrain, ...]
    ratios: Array | None = None
    alpha: float = 0.0
    air: Array = field(default_factory=lambda: ONE)
    unlike: Array = field(default_factory=lambda: np.zeros(1))
    uneven: float = 1.0
    incline_deg: float = 0.0
    condition: str = ""
    higher: tuple[float, ...] = ()
    aside: tuple[EdgeTrain, ...] = ()

    @property
    def strikes(self) -> Array:
        """Depth of the reference point below the contact point as each rod strikes, m."""
        places = np.array(self.chain.chain.heights)
        return places - self.higher if self.higher else places

    @property
    def pitch(self) -> float:
        """Least spacing of two rods, m; of a single object its width."""
        places, widths = self.chain.chain.heights, self.chain.widths
        return float(min(np.diff(places) if len(places) > 1 else widths))

    @property
    def top_shadow(self) -> float:
        """Length of the longest shadow that belongs to the top rod, which may rebound, m."""
        thrown = self.ratios is not None and self.chain.chain.rods > 1
        return WIDER * self.chain.widths[-1] if thrown else math.inf

    @property
    def edge_count(self) -> int:
        """Number of edges that a perfect rig would report."""
        return sum(train.rods.size for train in self.trains)

    def by_gate(self, match: Index) -> Iterator[tuple[EdgeTrain, slice, Index]]:
        """Yield each train, the slice of its expected edges, and the train's edge of each.

        Parameters
        ----------
        match
            For each expected edge of all trains the observed edge of all trains, −1 if missed.
        """
        begin = first = 0
        for train in self.trains:
            expected = slice(begin, begin + train.rods.size)
            edges = match[expected]
            yield train, expected, np.where(edges >= 0, edges - first, -1)
            begin, first = expected.stop, first + train.times.size


def edge_train(
    number: int,
    gate: Gate,
    chain: RodChain,
    edges: EdgeArrays,
    start: float,
    higher: tuple[float, ...] | None,
) -> EdgeTrain:
    """Return the observed and expected edges of a gate.

    Parameters
    ----------
    number
        Number of the gate in the protocol's list.
    edges
        All edges of the drop.
    start
        Nominal height of the bottom rod's middle before release, m.
    higher
        Height above the contact point at which each rod stops, m: no passage is expected below;
        `None` for a free chain.
    """
    at_gate = slice(*np.searchsorted(edges.channels, [gate.channel, gate.channel + 1]).tolist())
    # Some timers record only edges that darken a beam.
    darkening = bool(edges.blocked.size and edges.blocked.all())
    return EdgeTrain(
        number,
        edges.times[at_gate],
        edges.blocked[at_gate],
        edges.burst[at_gate],
        edges.numbers[at_gate],
        *_passages(gate.height, chain, start, higher, darkening),
        int(edges.received[gate.channel : gate.channel + 1].sum()) - edges.times[at_gate].size,
    )


@lru_cache(maxsize=256)  # a session needs the same few for every drop
def _passages(
    height: float, chain: RodChain, start: float, higher: tuple[float, ...] | None, darkening: bool
) -> tuple[Index, Flags, Array]:
    """Return rods, polarities and levels of a beam's expected edges, as in `EdgeTrain`."""
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


def thin(drop: Drop, hz: float) -> Drop:
    """Return a drop without the middles of long flickers, for repeated analysis."""
    numbers = np.sort(EdgeArrays.of(drop.edges, hz).numbers)
    return replace(drop, edges=tuple(drop.edges[n] for n in numbers.tolist()))


def unlike(chain: Chain, shares: Sequence[float]) -> Array:
    """Return κ of each rod alone less that of its chain, in units of κ.

    Parameters
    ----------
    shares
        κ of each rod together with all above it, in the same units.

    Returns
    -------
    ndarray
        Shape ``(rods,)``, or a single zero if all rods are alike.
    """
    masses = np.array(chain.masses)
    force = np.array(shares) * np.cumsum(masses[::-1])[::-1]
    more: Array = -np.diff(force, append=0.0) / masses - shares[0]
    return more if np.ptp(shares) else np.zeros(1)


def chain_records(
    protocol: Protocol, run: Run, drop: Drop, hz: float, aside: Collection[int] = ()
) -> list[ChainRecord]:
    """Return a record for each chain, with the trains of its gates.

    Parameters
    ----------
    aside
        Numbers of the gates that are left out, in the protocol's list.
    """
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
        # No rod falls after the last leg, but later edges need a leg too.
        legs = np.append(air, air[-1]) if impacts and np.ptp(air) else air[:1]
        records.append(
            ChainRecord(role, chain, used, air=legs, unlike=more, aside=unused, **impacts)
        )
    return records


def _impacts(protocol: Protocol, run: Run, role: Side, chain: RodChain) -> dict[str, Any]:
    """Return the impact fields of a chain's record; empty for a free chain."""
    if role == "free":
        return {}
    assert protocol.surface is not None
    # γ does not depend on the incline, and 0° is always in the domain of Eq. 13.
    gamma = impact_on(protocol.surface, chain.chain, 0.0).gamma
    alpha, uneven = 0.0, 1.0
    with suppress(DomainError):
        impact = impact_on(protocol.surface, chain.chain, run.incline_deg or 0.0)
        alpha, uneven = impact.alpha, _ON_RODS if impact.basis == "pile" else 1.0
    return {
        "ratios": np.array(kicks(chain.chain, [1.0] * chain.chain.rods, gamma)),
        "alpha": alpha,
        "uneven": uneven,
        "incline_deg": run.incline_deg or 0.0,
        "condition": str(protocol.condition(run)),
        "higher": higher_contacts(protocol, run.incline_deg or 0.0, chain),
    }
