"""A drop's edges as times, in a record for each chain.

Beside the observed edges of its gates stand the expected ones: all rods' sides that pass a beam
before the rod strikes the surface, or rods that lie on it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

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

MISSED = 0.02
"""Prior probability that a gate misses an edge."""
_HEAP, _STEEP = 0.25, 40.0
"""Mean height of a heap of rods on a level board, in units of the sum of their thicknesses, and the
incline above which there is none, °. In resolved falls it is 0.26 at 0 to 5°, 0.12 at 15 to 20° and
0.03 at 35°."""
QUICK = 0.3e-3
"""Edges of a gate closer than this are a flicker of the receiver, not two sides of a rod, s."""
SIDES = 2
"""Number of edges of a rod, or of a stray pulse."""
LONGEST = 64
"""Most edges kept of a flicker, to save time: its middle adds no information. A clean edge has 1,
a rod in front of a receiver that flickers with the mains about ten."""

WIDER = 1.2
"""Factor by which an object's width in a beam may differ from the stated one: if the beam passes
half a radius off its middle, the chord is 13 % shorter."""


class ObservedEdges(NamedTuple):
    """Observed edges, one gate after the other, shape ``(edges,)`` each.

    Attributes
    ----------
    times, blocked
        Each edge: seconds since the release fired, and the state after it.
    burst
        Duration of the flicker that each edge is part of, s; 0 for a clean edge.
    number
        Number of each edge in the drop's own list.
    gate
        Number of its gate in the protocol's list; in `DropEdges` its channel.
    """

    times: Array
    blocked: Flags
    burst: Array
    number: Index
    gate: Index


class DueEdges(NamedTuple):
    """Expected edges, one gate after the other, in order of time; shape ``(expected,)`` each.

    Attributes
    ----------
    rods, blocks
        Which rod passes, and whether it darkens the beam.
    levels
        Height of the chain's reference point by the nominal geometry, m; falling at each gate.
    gate
        Number of the gate in the protocol's list.
    absent
        Prior probability that the edge does not come: the gate misses it, or a heap of rods, of
        exponentially distributed height, stops the rod before or darkens the beam.
    """

    rods: Index
    blocks: Flags
    levels: Array
    gate: Index
    absent: Array

    @property
    def blame(self) -> Array:
        """Probability that the gate has missed the edge if it does not come."""
        return np.asarray(MISSED / self.absent * (1.0 - self.absent) / (1.0 - MISSED))


class DropEdges(NamedTuple):
    """Edges of a drop by channel.

    Attributes
    ----------
    edges
        Of a flicker of more than `LONGEST` edges that many, half at either end.
    received
        Number of edges by channel, including those left out; shape ``(channels,)``.
    """

    edges: ObservedEdges
    received: Index

    @classmethod
    def of(cls, rows: Sequence[Sequence[int]], hz: float) -> DropEdges:
        """Return arrays of edges given as rows of tick, channel and state; `hz` in ticks/s."""
        flat = itertools.chain.from_iterable(rows)  # much faster than an array of rows
        edges = np.fromiter(flat, np.int64, 3 * len(rows)).reshape(-1, 3)
        order = np.argsort(edges[:, 1], kind="stable")
        times, channels = edges[order, 0] / hz, edges[order, 1].astype(np.intp)
        begins = np.diff(times, prepend=-np.inf) > QUICK
        begins |= np.diff(channels, prepend=-1) != 0
        first, flicker = np.flatnonzero(begins), np.cumsum(begins) - 1
        last = np.append(first[1:], times.size)[: first.size] - 1
        place = np.arange(times.size)
        from_end = np.minimum(place - first[flicker], last[flicker] - place)
        spared = np.flatnonzero(from_end < LONGEST // 2)
        burst, blocked = times[last] - times[first], edges[order[spared], 2].astype(np.bool_)
        seen = times[spared], blocked, burst[flicker[spared]], order[spared], channels[spared]
        return cls(ObservedEdges(*seen), np.bincount(channels, minlength=1))

    def at(self, gates: Sequence[tuple[int, Gate]]) -> tuple[ObservedEdges, int]:
        """Return the edges of some gates with their numbers, and how many of these are left out."""
        channels = [gate.channel for _, gate in gates]
        ends = np.searchsorted(self.edges.gate, np.add.outer(channels, [0, 1]))
        places = np.concatenate([np.arange(*end) for end in ends])
        edges = ObservedEdges(*(column[places] for column in self.edges))
        numbers = np.repeat([number for number, _ in gates], np.diff(ends)[:, 0])
        received = sum(int(self.received[n : n + 1].sum()) for n in channels)
        return edges._replace(gate=numbers), received - places.size


@dataclass(frozen=True, slots=True, eq=False)
class ChainRecord:
    """One chain and the gates beside it.

    Attributes
    ----------
    role
        ``impact`` or ``free``.
    chain
        The chain that hangs there.
    edges
        Observed edges at its gates.
    due
        Expected edges at its gates, but for those `aside`.
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
    incline_deg
        Inclination of the surface that it strikes.
    condition
        Name of the condition; drops under the same condition share the contact unknowns.
    heap
        Mean height of the heap on which each rod strikes, m.
    higher
        Height of each rod's middle above the contact point as its impact acts, m; empty for a free
        chain. Results refer to the level: the top rod falls on as if no rod lay there.
    aside
        Numbers of gates that are left out, too low for every rod to pass.
    thinned
        Number of edges left out, from the middle of flickers longer than `LONGEST`.
    blank
        The record without edges, which all drops of a condition have in common.
    scene
        What all but the edges follows from, with the protocol; equal for those drops.
    """

    role: Side
    chain: RodChain
    edges: ObservedEdges
    due: DueEdges
    ratios: Array | None = None
    alpha: float = 0.0
    air: Array = field(default_factory=lambda: ONE)
    unlike: Array = field(default_factory=lambda: np.zeros(1))
    incline_deg: float = 0.0
    condition: str = ""
    heap: Array = field(default_factory=lambda: np.zeros(1))
    higher: tuple[float, ...] = ()
    aside: tuple[int, ...] = ()
    thinned: int = 0
    blank: ChainRecord | None = field(default=None, repr=False)
    scene: tuple[object, ...] = ()

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
        return self.due.rods.size


def _due_edges(
    gates: Sequence[tuple[int, Gate]],
    chain: RodChain,
    start: float,
    impacts: Mapping[str, Any],
    darkening: bool,
) -> DueEdges:
    """Return the expected edges of a chain.

    Parameters
    ----------
    gates
        Each gate with its number in the protocol's list.
    start
        Nominal height of the bottom rod's middle before release, m.
    impacts
        See `_impacts`: a rod that has struck slides on, but no passage is expected below the
        contact point. Empty for a free chain.
    darkening
        Whether the timer records only edges that darken a beam, as some do.
    """
    places, half = np.array(chain.chain.heights), np.array(chain.widths)[:, None] / 2.0
    beams = np.array([gate.height for _, gate in gates])
    # A rod's lower side darkens the beam, its upper side clears it.
    levels = (beams[:, None, None] - places[:, None] + np.array([1.0, -1.0]) * half).ravel()
    rods = np.tile(np.repeat(np.arange(places.size), 2), beams.size)
    blocks = np.arange(levels.size) % 2 == 0
    seen = (levels < start) & (blocks | (not darkening))
    absent = np.full(levels.size, MISSED)
    if impacts:
        above, high = levels + places[rods], impacts["heap"][rods]
        seen &= above > 0.0
        # A heap up to a rod's upper side at the beam keeps both its edges from coming.
        upper = np.repeat((above - np.array(impacts["higher"])[rods])[1::2], 2).clip(0.0)
        far = np.full_like(absent, np.inf)
        absent += (1.0 - 2.0 * MISSED) * np.exp(-np.divide(upper, high, far, where=high > 0.0))
    gate = np.repeat([number for number, _ in gates], 2 * places.size)
    due = DueEdges(rods[seen], blocks[seen], levels[seen], gate[seen], absent[seen])
    for values in due:  # every drop has the same arrays
        values.flags.writeable = False
    return due


def thin(drop: Drop, hz: float) -> Drop:
    """Return a drop without the middles of long flickers, for repeated analysis."""
    numbers = np.sort(DropEdges.of(drop.edges, hz).edges.number)
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
    """Return a record for each chain, with the edges of its gates.

    Parameters
    ----------
    aside
        Numbers of the gates that are left out, in the protocol's list.
    """
    whole, records = DropEdges.of(drop.edges, hz), []
    darkening = bool(whole.edges.blocked.size and whole.edges.blocked.all())
    for blank in _blank_records(protocol, run.kind, (*aside,), darkening):
        edges, thinned = whole.at(_gates_at(protocol, blank.role))
        records.append(replace(blank, edges=edges, thinned=thinned, blank=blank))
    return records


def _gates_at(protocol: Protocol, side: Side) -> list[tuple[int, Gate]]:
    return [(n, gate) for n, gate in enumerate(protocol.gates.gates) if gate.side == side]


@lru_cache(maxsize=128)  # a session needs the same few for every drop
def _blank_records(
    protocol: Protocol, run: Run, aside: tuple[int, ...], darkening: bool
) -> list[ChainRecord]:
    """Return a record without edges for each chain, as `chain_records`.

    Parameters
    ----------
    darkening
        As for `_due_edges`.
    """
    shares, records = air_shares(protocol), []
    sides: tuple[tuple[Side, str | None], ...] = (("impact", run.impact), ("free", run.free))
    for role, name in sides:
        gates = _gates_at(protocol, role)
        if name is None or not gates:
            continue
        chain, air = protocol.chains[name], np.array(shares[name])
        impacts = {} if role == "free" else _impacts(protocol, run, chain)
        used = [(n, gate) for n, gate in gates if n not in aside]
        records.append(
            ChainRecord(
                role,
                chain,
                DropEdges.of((), 1.0).edges,
                _due_edges(used, chain, protocol.drop.value, impacts, darkening),
                # No rod falls after the last leg, but later edges need a leg too.
                air=np.append(air, air[-1]) if impacts and np.ptp(air) else air[:1],
                unlike=unlike(chain.chain, shares[name]),
                aside=tuple(n for n, _ in gates if n in aside),
                scene=(role, run, aside, darkening),
                **impacts,
            )
        )
    return records


def _impacts(protocol: Protocol, run: Run, chain: RodChain) -> dict[str, Any]:
    """Return the fields of a striking chain's record that a free chain's has not."""
    assert protocol.surface is not None
    # γ does not depend on the incline, and 0° is always in the domain of Eq. 13.
    gamma = impact_on(protocol.surface, chain.chain, 0.0).gamma
    alpha = 0.0
    with suppress(DomainError):
        alpha = impact_on(protocol.surface, chain.chain, run.incline_deg).alpha
    return {
        "ratios": np.array(kicks(chain.chain, [1.0] * chain.chain.rods, gamma)),
        "alpha": alpha,
        "incline_deg": run.incline_deg,
        "condition": str(protocol.condition(run)),
        "heap": _heap(chain, run.incline_deg),
        "higher": higher_contacts(protocol, run.incline_deg, chain),
    }


def _heap(chain: RodChain, incline_deg: float) -> Array:
    """Return the mean height of the heap on which each rod strikes, m; 0 without thicknesses."""
    thick = np.array(chain.diameters or [0.0] * chain.chain.rods)
    return np.asarray(_HEAP * max(0.0, 1.0 - incline_deg / _STEEP) * (np.cumsum(thick) - thick))
