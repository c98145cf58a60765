"""What may be otherwise at a rig than its protocol says: one thing each, of some size.

A fault is a change of what a drop is read with, and the reason that names it.
`rig.analysis.explanations` weighs faults against each other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rig.analysis.unknowns import Unknown
from rig.units import Quantity

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Mapping, Sequence

    from rig.analysis.drop_model import DropModel
    from rig.arrays import Array
    from rig.protocol.protocol import Gate, Gates, Protocol, RodChain, Run


_MORE = 3  # rods by which a chain may differ
_WIDER = 0.5  # of its thinnest rod, by which rods may look thicker or thinner


class Premise(NamedTuple):
    """What a drop is read with, see `rig.analysis.chain_records.chain_records`."""

    protocol: Protocol
    run: Run
    hz: float
    aside: tuple[int, ...] = ()


@dataclass(frozen=True)
class Shift:
    """What a fault of size 1 does to what a protocol states.

    Attributes
    ----------
    drop, clock, gravity
        To the drop height, m, the rate of the clock, relative, and gravity, m/s².
    gates
        To the height of each gate, m; none where it leaves them.
    chains
        Names of the chains that are longer or thicker.
    length, width
        To their length, relative, and the width of their rods, m.
    """

    drop: float = 0.0
    clock: float = 0.0
    gravity: float = 0.0
    gates: tuple[float, ...] = ()
    chains: frozenset[str] = frozenset()
    length: float = 0.0
    width: float = 0.0

    def premise(self, stated: Premise, size: float) -> Premise:
        """Return what a drop is read with as it is with a fault of some size."""
        protocol, placed = stated.protocol, _placed(stated.protocol)
        drop, gravity = protocol.drop, protocol.gravity
        shifts = self.gates or (0.0,) * len(placed.gates)
        gates = [
            replace(gate, height=gate.height + size * shift)
            for gate, shift in zip(placed.gates, shifts, strict=True)
        ]
        chains = {name: self._resized(protocol.chains[name], size) for name in self.chains}
        changed = replace(
            protocol,
            drop=Quantity(drop.value + size * self.drop, drop.u),
            gravity=Quantity(gravity.value + size * self.gravity, gravity.u),
            gates=replace(placed, gates=tuple(gates)),
            chains={**protocol.chains, **chains},
        )
        return stated._replace(protocol=changed, hz=stated.hz * (1.0 - size * self.clock))

    def _resized(self, chain: RodChain, size: float) -> RodChain:
        heights = tuple(height * (1.0 + size * self.length) for height in chain.chain.heights)
        widths = tuple(width + size * self.width for width in chain.widths)
        return replace(chain, chain=replace(chain.chain, heights=heights), widths=widths)

    def direction(self, model: DropModel) -> Array:
        """Return what it does to all unknowns of a drop, shape ``(unknowns,)``."""
        at = model.unknowns
        moved = np.zeros(len(at))
        for name in ("drop", "clock", "gravity"):
            moved[at[name]] = getattr(self, name)
        moved[at["beams"]] = self.gates or 0.0
        for role, record in model.records.items():
            if record.chain.name in self.chains:
                moved[at[f"{role} rods"]] = self.length * np.array(record.chain.chain.heights)
                moved[at[f"{role} width"]] = self.width
        return moved


@dataclass(frozen=True)
class Fault:
    """One way in which a rig may differ from its protocol.

    Attributes
    ----------
    code
        Of the reason that names it.
    where
        Values of that reason whatever the size: which chain, gate or side.
    symbol, unit, scale, offset
        Under which the reason has the size, its unit as names end with it, by what the size is
        multiplied for it, and what is added; no symbol where a fault has no size.
    sizes
        Tried at first; apart by no more than what a reading tolerates.
    shift
        Where sizes between them count too: what a fault of size 1 does.
    exchange
        Where they do not: the premise as it is with a fault of some size.
    of_air
        Whether its size is κ, which every drop tells that is not told of the air.
    """

    code: str
    where: Mapping[str, Any] = field(default_factory=dict)
    symbol: str = ""
    unit: str = ""
    scale: float = 1
    offset: float = 0
    sizes: tuple[float, ...] = (0.0,)
    shift: Shift | None = None
    exchange: Callable[[Premise, float], Premise] = lambda stated, _size: stated
    of_air: bool = False

    def values(self, size: float, u: float) -> dict[str, Any]:
        """Return the values of the reason that names it; no uncertainty of what is counted."""
        values = dict(self.where)
        if self.symbol:
            values[f"{self.symbol}{self.unit}"] = self.offset + self.scale * size
        if u:
            values[f"U95{self.unit}"] = 2.0 * self.scale * u
        return values

    def premise(self, stated: Premise, size: float) -> Premise:
        """Return what a drop is read with as it is with a fault of some size."""
        return (self.shift.premise if self.shift else self.exchange)(stated, size)

    def suspect(self, model: DropModel) -> Unknown:
        """Return its size as one thing more that is not known of a drop, in the range of its sizes.

        At its mean a normal distribution has the density of an even one √(2π) times as wide as its
        standard deviation.
        """
        assert self.shift is not None
        direction = self.shift.direction(model)
        span = max(self.sizes) - min(self.sizes)
        return Unknown(
            "fault",
            "edges",
            lambda _side: span / math.sqrt(2.0 * math.pi),
            moves="all",
            path=lambda side: (model.slopes[side.record.role].path @ direction)[:, None],
            level=lambda side: model.slopes[side.record.role].levels @ direction,
            rate=float(model.unknowns.rate @ direction),
        )


def faults(protocol: Protocol, run: Run, suspect: Sequence[int]) -> list[Fault]:
    """All faults that a scene may have and that could be told from each other.

    Parameters
    ----------
    suspect
        Numbers of the gates of which any two may be exchanged.
    """
    gates = _placed(protocol).gates
    exchanges = [_exchange(gates, a, b) for a, b in combinations(suspect, 2)]
    chains, rig = _chain_faults(protocol, run), _rig_faults(protocol)
    return [*chains, *rig, *_gate_faults(gates), *exchanges]


def _sized(
    code: str, shift: Shift, limit: float, step: float, *names: str, scale: float = 1, **where: Any
) -> Fault:
    """A fault of any size up to a limit, tried in steps; named as a length if not otherwise."""
    count = math.ceil(limit / step)
    sizes = tuple(step * n for n in range(-count, count + 1) if n)
    symbol, unit = names or ("size", "_m")
    return Fault(code, where, symbol, unit, scale, sizes=sizes, shift=shift)


def _chain_faults(protocol: Protocol, run: Run) -> Iterator[Fault]:
    """Faults of each chain, of both where they are alike, and of their places."""
    names = {role: name for role, name in (("impact", run.impact), ("free", run.free)) if name}
    groups = [(frozenset({name}), name) for name in names.values()]
    if len(names) > 1:
        groups.append((frozenset(names.values()), ""))
    for group, name in groups:
        chain = protocol.chains[min(group)]
        top, rods = chain.chain.heights[-1], chain.chain.rods
        if rods > 1:  # one object has no length, and is no chain with rods missing
            longer = Shift(chains=group, length=1.0)
            yield _sized("chain_length", longer, 0.06, 0.015, scale=top, name=name)
            yield Fault(
                "rod_count",
                {"name": name, "stated": rods},
                "rods",
                offset=rods,
                sizes=tuple(n for n in range(-_MORE, _MORE + 1) if n and rods + n >= 2),
                exchange=_with_chains(group, _with_more),
            )
        limit = _WIDER * min(chain.widths)
        yield _sized("thickness", Shift(chains=group, width=1.0), limit, limit, name=name)
    for role, name in names.items():
        if upside_down(protocol.chains[name]) is not None:
            turned = _with_chains({name}, lambda chain, _: upside_down(chain) or chain)
            yield Fault("upside_down", {"name": name, "side": role}, exchange=turned)
    if len(names) > 1 and protocol.unlike_chains:
        yield Fault(
            "chains_exchanged",
            {"impact": run.impact, "free": run.free},
            exchange=lambda stated, _: stated._replace(
                run=replace(stated.run, impact=stated.run.free, free=stated.run.impact)
            ),
        )


def _rig_faults(protocol: Protocol) -> Iterator[Fault]:
    """Faults of everything that both chains share."""
    yield _sized("drop_height", Shift(drop=1.0), 60e-3, 10e-3)
    yield _sized("clock", Shift(clock=1.0), 0.05, 0.01, "share", "")
    if protocol.drag is not None:
        yield Fault(
            "air",
            symbol="kappa",
            exchange=lambda stated, _: stated._replace(
                protocol=replace(stated.protocol, drag=None)
            ),
            of_air=True,
        )
    if protocol.surface is not None:
        # From beam to beam nobody knows the contact point, and gravity is what is measured.
        gates = _placed(protocol).gates
        yield _raised("all_gates", gates, gates)
        gravity = Shift(gravity=protocol.gravity.value)
        yield _sized("gravity", gravity, 0.10, 0.02, "share", "")


def _gate_faults(gates: Sequence[Gate]) -> Iterator[Fault]:
    """Faults of the post of several gates, and of each gate."""
    sides = [gate.side for gate in gates]
    for side in dict.fromkeys(sides):
        if 1 < sides.count(side) < len(sides):
            post = [gate for gate in gates if gate.side == side]
            yield _raised("post", gates, post, side=side)
    for gate in gates if len(gates) > 1 else ():
        yield _raised("gate_height", gates, [gate], **gate_values(gate))


def _raised(code: str, gates: Sequence[Gate], wrong: Collection[Gate], **where: Any) -> Fault:
    shift = Shift(gates=tuple(float(gate in wrong) for gate in gates))
    return _sized(code, shift, 40e-3, 10e-3, **where)


def _placed(protocol: Protocol) -> Gates:
    assert protocol.gates is not None
    return protocol.gates


def _exchange(gates: Sequence[Gate], a: int, b: int) -> Fault:
    def exchange(stated: Premise, _: float) -> Premise:
        protocol, changed = stated.protocol, [*gates]
        changed[a] = replace(gates[a], channel=gates[b].channel)
        changed[b] = replace(gates[b], channel=gates[a].channel)
        placed = replace(_placed(protocol), gates=tuple(changed))
        return stated._replace(protocol=replace(protocol, gates=placed))

    both = [gate_values(gates[a]), gate_values(gates[b])]
    return Fault("gates_exchanged", {"at": both}, exchange=exchange)


def gate_values(gate: Gate) -> dict[str, Any]:
    """Return the values by which a reason names a gate, so that one can find it."""
    height = gate.height if gate.stated is None else gate.stated
    return {"channel": gate.channel, "side": gate.side, "height_m": height}


def _with_chains(
    names: Collection[str], replacement: Callable[[RodChain, float], RodChain]
) -> Callable[[Premise, float], Premise]:
    def change(setting: Premise, size: float) -> Premise:
        chains = {
            name: replacement(chain, size) if name in names else chain
            for name, chain in setting.protocol.chains.items()
        }
        return setting._replace(protocol=replace(setting.protocol, chains=chains))

    return change


def _with_rods(chain: RodChain, order: Sequence[int], heights: Sequence[float]) -> RodChain:
    """Hang rods of a chain, by their numbers, at other heights above the lowest one."""

    def chosen(values: tuple[float, ...]) -> tuple[float, ...]:
        return tuple(values[n] for n in order)

    hung = replace(chain.chain, masses=chosen(chain.chain.masses), heights=tuple(heights))
    widths, diameters = chosen(chain.widths), chosen(chain.diameters)
    return replace(chain, chain=hung, widths=widths, diameters=diameters)


def _with_more(chain: RodChain, count_more: float) -> RodChain:
    """Add rods like the top one at the top, or take some off."""
    heights, count = chain.chain.heights, chain.chain.rods + round(count_more)
    top, pitch = len(heights) - 1, heights[-1] - heights[-2] if len(heights) > 1 else 0.0
    order = [min(n, top) for n in range(count)]
    return _with_rods(chain, order, [heights[k] + pitch * (n - k) for n, k in enumerate(order)])


def upside_down(chain: RodChain) -> RodChain | None:
    """Turn a chain round; `None` where that makes no difference."""
    heights = chain.chain.heights
    turned = [heights[-1] - height for height in heights[::-1]]
    alike = all(abs(a - b) < 1e-3 for a, b in zip(turned, heights, strict=True))
    if alike and chain.widths[::-1] == chain.widths:
        return None
    return _with_rods(chain, range(len(heights))[::-1], turned)
