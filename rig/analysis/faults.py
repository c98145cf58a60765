"""Set-up faults: ways in which a rig may differ from its protocol.

A fault is a change of the premise with which a drop is analysed, and the reason that names it.
`rig.analysis.explanations` compares faults.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import combinations, product
from typing import Any, NamedTuple

import numpy as np

from rig.analysis.annealing import count_matched
from rig.analysis.drop_model import DropModel
from rig.analysis.fit import DropFit
from rig.analysis.unknowns import Unknown
from rig.arrays import Array
from rig.protocol.protocol import Gate, Protocol, RodChain, Run

_MORE = 3  # rods by which a chain may differ
_WIDER = 0.5  # share of the thinnest rod by which rods may differ in thickness
_BEHIND = 0.1  # m by which a braked chain may be behind at its last edge
_UNTOLD = 0.5
"""Departures of a chain that no fault explains, in units of its edges' scatter."""
_MOMENTS = 16
"""Parts of a fall at whose ends a chain may be braked, and parts of one of these."""


class Premise(NamedTuple):
    """Assumptions of a drop's analysis: arguments of `chain_records`."""

    protocol: Protocol
    run: Run
    hz: float
    aside: tuple[int, ...] = ()

    @property
    def gates(self) -> tuple[Gate, ...]:
        """The gates of the protocol."""
        return self.protocol.gates.gates

    def change(self, **fields: Any) -> Premise:
        """Return the premise with other fields of its protocol."""
        return self._replace(protocol=replace(self.protocol, **fields))

    def with_gates(self, gates: Sequence[Gate]) -> Premise:
        """Return the premise with other gates."""
        return self._replace(protocol=self.protocol.with_gates(gates))


Change = Callable[[Premise, float], Premise]


@dataclass(frozen=True)
class Fault:
    """A way in which a rig may differ from its protocol.

    Attributes
    ----------
    code
        Code of the reason that names the fault.
    change
        Function that returns the premise changed by a fault of some size.
    where
        Values of the reason that do not depend on the size: chain, gate or side.
    size
        Name of the size among the values of the reason; empty for a fault without a size.
    sizes
        Sizes tried first; of a continuous size at intervals that identification tolerates.
    ways
        Number of sizes that are equally likely beforehand, if it is not that of `sizes`.
    continuous
        Whether the size is fitted. The premise then changes in proportion to it.
    moment, power
        Share of the time from the first to the last edge of its side after which a chain is braked
        (a brake before them is a late release of a chain that hangs elsewhere), and the power of
        the time since with which it falls behind: 1 after a jerk, 2 while something rubs. 0 for any
        other fault.
    """

    code: str
    change: Change
    where: Mapping[str, Any] = field(default_factory=dict)
    size: str = ""
    sizes: tuple[float, ...] = (0.0,)
    ways: int = 0
    continuous: bool = False
    moment: float = 0.0
    power: int = 0

    @property
    def kin(self) -> object:
        """The same for brakes of a side, of which only the likeliest counts."""
        return self.where["side"] if self.power else id(self)

    @property
    def alike(self) -> list[Fault]:
        """The fault, and if it is a brake those at moments between the ones next to it."""
        finer = np.arange(1 - _MOMENTS, _MOMENTS) / _MOMENTS**2 if self.power else np.zeros(1)
        return [replace(self, moment=self.moment + later) for later in finer.tolist()]

    def values(self, size: float, u: float) -> dict[str, Any]:
        """Return the values of the reason that names the fault; `u` is 0 for a count."""
        sizes = {self.size: size} if self.size else {}
        sizes |= {"U95_m" if self.size == "size_m" else "U95": 2.0 * u} if u else {}
        return {**self.where, **sizes}

    def cost(self, fit: DropFit) -> float:
        """Return the log odds that a continuous fault must make up for, beside its prior's.

        Of many moments one is chosen. And without a brake, too, a chain may depart from its fitted
        fall by a part of its edges' scatter.
        """
        edges = count_matched(fit.matches[self.where["side"]]) if self.power else 0
        return math.log(self.ways or 1) + 0.5 * _UNTOLD**2 * edges

    def braked(self, fit: DropFit) -> Braked | None:
        """Return what a brake does to a drop's edges; `None` for any other fault."""
        if not self.power:
            return None
        times, speeds = _passages(fit, self.where["side"])
        moment = times.min() + self.moment * np.ptp(times)  # a fitted side has edges
        behind = (np.maximum(times - moment, 0.0) / (times.max() - moment)) ** self.power
        return Braked(self.where["side"], float(moment), behind, behind / speeds)

    def direction(self, stated: Premise, model: DropModel) -> Array:
        """Return the change of a drop's unknowns by a fault of size 1, shape ``(unknowns,)``."""
        at, changed = model.unknowns, self.change(stated, 1.0)
        before, after = stated.protocol, changed.protocol
        moved = np.zeros(len(at))
        moved[at["drop"]] = after.drop.value - before.drop.value
        moved[at["gravity"]] = after.gravity.value - before.gravity.value
        moved[at["clock"]] = 1.0 - changed.hz / stated.hz
        pairs = zip(changed.gates, stated.gates, strict=True)
        moved[at["beams"]] = [gate.height - other.height for gate, other in pairs]
        for role, record in model.records.items():
            chain, other = (part.chains[record.chain.name] for part in (after, before))
            moved[at[f"{role} rods"]] = np.subtract(chain.chain.heights, other.chain.heights)
            moved[at[f"{role} width"]] = chain.widths[0] - other.widths[0]
        return moved

    def suspect(self, model: DropModel, direction: Array, braked: Braked | None) -> Unknown:
        """Return the size as a further unknown, with a normal prior for the range of sizes.

        The prior's density at its mean is that of a uniform distribution over the range, whose
        width is √(2π) standard deviations.
        """
        behind = {braked.side: braked.behind} if braked else {}
        return Unknown(
            "fault",
            "edges",
            lambda _side: float(np.ptp(self.sizes)) / math.sqrt(2.0 * math.pi),
            moves="all",
            path=lambda side: (model.slopes[side.record.role].path @ direction)[:, None],
            level=lambda side: (
                model.slopes[side.record.role].levels @ direction
                - behind.get(side.record.role, 0.0)
            ),
            rate=float(model.unknowns.rate @ direction),
        )


class Braked(NamedTuple):
    """A chain that loses speed at some moment, and is 1 m behind at its last edge.

    Attributes
    ----------
    side
        Its side.
    time_s
        The moment, s after its release.
    behind, late
        How far behind and how late it is at each expected edge, m and s.
    """

    side: str
    time_s: float
    behind: Array
    late: Array


@lru_cache(maxsize=2)  # all brakes of a drop ask for the same
def _passages(fit: DropFit, role: str) -> tuple[Array, Array]:
    """Return when each expected edge comes, s after the release, and the speed then."""
    path = fit.model.trajectory(role, fit.x)
    times, speeds = path.passages(fit.model.all_levels(role, fit.x))
    return times - float(path.time[0]), np.maximum(speeds, np.finfo(float).tiny)


class Suspects(NamedTuple):
    """What a drop's edges cast doubt on.

    Attributes
    ----------
    gates
        Numbers of the gates of which any two may be exchanged.
    rods
        Numbers of the rods that no gate saw, by chain; the lowest is 0.
    more
        Whether all gates of a chain have edges after its last rod, or two gates may have each
        other's edges.
    """

    gates: Sequence[int] = ()
    rods: Mapping[str, Sequence[int]] = {}
    more: bool = False


def faults(stated: Premise, suspects: Suspects) -> Iterator[Fault]:
    """Yield all distinguishable faults of a scene."""
    run, protocol = stated.run, stated.protocol
    sides = {"impact": run.impact, "free": run.free}
    hung = {side: protocol.chains[name] for side, name in sides.items() if name}
    for side, chain in hung.items():
        yield from _size_faults([chain], chain.name)
        yield from _order_faults(chain, side, suspects.rods.get(chain.name, ()))
        if chain.chain.rods > 1:
            yield from _brakes(side)
    if len(hung) > 1:
        yield from _size_faults([*hung.values()])
        if protocol.unlike_chains:
            crossed = replace(run, impact=run.free, free=run.impact)
            yield Fault("chains_exchanged", lambda stated, _: stated._replace(run=crossed), sides)
    yield from _rig_faults(stated)
    yield from _gate_faults(stated.gates)
    for pair in combinations(suspects.gates, 2):
        yield _exchange(stated.gates, *pair)


def _continuous(
    code: str, change: Change, limit: float, step: float, size: str = "size_m", **where: Any
) -> Fault:
    """Return a fault of any size up to ±`limit`, tried in steps; by default a length."""
    count = math.ceil(limit / step)
    sizes = tuple(step * n for n in range(-count, count + 1) if n)
    return Fault(code, change, where, size, sizes, continuous=True)


def _size_faults(chains: Sequence[RodChain], name: str = "") -> Iterator[Fault]:
    """Yield the faults of the size of one chain, or of both chains together without a name."""
    first, names = chains[0].chain, [chain.name for chain in chains]
    if first.rods > 1:  # a single object has neither length nor missing rods
        limit, step = 0.06 * first.length, 0.015 * first.length
        stretched = _of_rods(names, lambda rods, size: _stretch(rods, 1.0 + size / first.length))
        yield _continuous("chain_length", stretched, limit, step, name=name)
        counts = {*range(max(2, first.rods - _MORE), first.rods + _MORE + 1)} - {first.rods}
        more = _of_rods(names, lambda rods, count: _add(rods, round(count) - first.rods))
        where = {"name": name, "stated": first.rods}
        yield Fault("rod_count", more, where, "rods", tuple(sorted(counts)))
    limit = _WIDER * min(chains[0].widths)
    yield _continuous("thickness", _of_rods(names, _thicken), limit, limit, name=name)


def _order_faults(chain: RodChain, side: str, absent: Sequence[int]) -> Iterator[Fault]:
    """Yield the faults of a chain's order on a side: upside down, or with a gap."""
    where, count, rods = {"name": chain.name, "side": side}, chain.chain.rods, rods_of(chain)
    if not all(alike(*pair) for pair in zip(rods, turn(rods), strict=True)):
        yield Fault("upside_down", _of_rods([chain.name], lambda rods, _: turn(rods)), where)
    # Without a rod at an end, it has fewer rods or another drop height.
    if numbers := tuple(rod + 1 for rod in absent if 0 < rod < count - 1):
        gap = _of_rods([chain.name], lambda rods, n: [*rods[: round(n) - 1], *rods[round(n) :]])
        yield Fault("rod_missing", gap, where | {"rods": count}, "rod", numbers, ways=count)


def _brakes(side: str) -> Iterator[Fault]:
    """Yield a side's chain braked at each moment, in either way."""
    where, sizes = {"side": side}, (0.0, _BEHIND)
    braked = Fault("braked", lambda same, _: same, where, "size_m", sizes, continuous=True)
    for part, power in product(range(1, _MOMENTS), (1, 2)):
        yield replace(braked, ways=2 * (_MOMENTS - 1), moment=part / _MOMENTS, power=power)


def _rig_faults(stated: Premise) -> Iterator[Fault]:
    """Yield the faults of everything that both chains share."""
    yield _continuous("drop_height", _hang_higher, 60e-3, 10e-3)
    yield _continuous(
        "clock", lambda at, share: at._replace(hz=at.hz * (1.0 - share)), 0.05, 0.01, "share"
    )
    if stated.protocol.drag is not None:
        yield Fault("air", lambda premise, _: premise.change(drag=None), size="kappa")
    if stated.protocol.surface is not None:
        # Without a surface there is no contact point, and gravity is the measurand.
        yield _raised("all_gates", range(len(stated.gates)))
        yield _continuous("gravity", _add_gravity, 0.10, 0.02, "share")


def _gate_faults(gates: Sequence[Gate]) -> Iterator[Fault]:
    """Yield the faults of each post with several gates, and of each gate."""
    sides = [gate.side for gate in gates]
    for side in dict.fromkeys(sides):
        post = [n for n, gate in enumerate(gates) if gate.side == side]
        if 1 < len(post) < len(gates):
            yield _raised("post", post, side=side)
    for n, gate in enumerate(gates) if len(gates) > 1 else ():
        yield _raised("gate_height", [n], **gate_values(gate))


def _hang_higher(premise: Premise, size: float) -> Premise:
    drop = premise.protocol.drop
    return premise.change(drop=replace(drop, value=drop.value + size))


def _add_gravity(premise: Premise, share: float) -> Premise:
    gravity = premise.protocol.gravity
    return premise.change(gravity=replace(gravity, value=gravity.value * (1.0 + share)))


def _raised(code: str, numbers: Collection[int], **where: Any) -> Fault:
    """Return the fault of some gates, by number, that are higher or lower."""

    def change(premise: Premise, size: float) -> Premise:
        gates = [
            replace(gate, height=gate.height + size) if n in numbers else gate
            for n, gate in enumerate(premise.gates)
        ]
        return premise.with_gates(gates)

    return _continuous(code, change, 40e-3, 10e-3, **where)


def _exchange(gates: Sequence[Gate], a: int, b: int) -> Fault:
    """Return the fault of two gates, by number, on each other's channel."""

    def change(premise: Premise, _: float) -> Premise:
        exchanged = [*premise.gates]
        exchanged[a] = replace(gates[a], channel=gates[b].channel)
        exchanged[b] = replace(gates[b], channel=gates[a].channel)
        return premise.with_gates(exchanged)

    return Fault("gates_exchanged", change, {"at": [gate_values(gates[n]) for n in (a, b)]})


def gate_values(gate: Gate) -> dict[str, Any]:
    """Return the values by which a reason names a gate: channel, side and stated height."""
    height = gate.height if gate.stated is None else gate.stated
    return {"channel": gate.channel, "side": gate.side, "height_m": height}


class Rod(NamedTuple):
    """A rod of a chain, as in `RodChain`; its height is above the lowest rod, m."""

    mass: float
    height: float
    width: float
    diameter: float


def rods_of(chain: RodChain) -> list[Rod]:
    """Return the rods of a chain, bottom up."""
    rods = zip(chain.chain.masses, chain.chain.heights, chain.widths, chain.diameters, strict=True)
    return [Rod(*values) for values in rods]


def _of_rods(names: Collection[str], change: Callable[[list[Rod], float], list[Rod]]) -> Change:
    """Return the change of a premise by a change of the rods of some chains."""

    def changed(premise: Premise, size: float) -> Premise:
        chains = dict(premise.protocol.chains)
        for name in names:
            rods = change(rods_of(chains[name]), size)
            masses, heights, widths, diameters = zip(*rods, strict=True)
            hung = replace(chains[name].chain, masses=masses, heights=heights)
            chains[name] = replace(chains[name], chain=hung, widths=widths, diameters=diameters)
        return premise.change(chains=chains)

    return changed


def _stretch(rods: list[Rod], by: float) -> list[Rod]:
    return [rod._replace(height=rod.height * by) for rod in rods]


def _thicken(rods: list[Rod], size: float) -> list[Rod]:
    return [rod._replace(width=rod.width + size) for rod in rods]


def _add(rods: list[Rod], more: int) -> list[Rod]:
    """Return a chain with rods like the top rod added at the top, or with rods removed."""
    top, pitch = rods[-1], rods[-1].height - rods[max(0, len(rods) - 2)].height
    added = [top._replace(height=top.height + pitch * n) for n in range(1, more + 1)]
    return [*rods[: len(rods) + more], *added]


def turn(rods: list[Rod]) -> list[Rod]:
    """Return a chain upside down."""
    return [rod._replace(height=rods[-1].height - rod.height) for rod in rods[::-1]]


def alike(rod: Rod, other: Rod) -> bool:
    """Whether two rods at the same place of two chains cannot be told apart."""
    return abs(rod.height - other.height) < 1e-3 and rod.width == other.width
