"""Set-up faults: ways in which a rig may differ from its protocol.

A fault is a change of the premise with which a drop is analysed, and the reason that names it.
`rig.analysis.explanations` compares faults.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations, repeat
from typing import Any, NamedTuple

import numpy as np

from rig.analysis.drop_model import DropModel
from rig.analysis.unknowns import Unknown
from rig.arrays import Array
from rig.protocol.protocol import Gate, Gates, Protocol, RodChain, Run

_MORE = 3  # rods by which a chain may differ
_WIDER = 0.5  # share of the thinnest rod by which rods may differ in thickness


class Premise(NamedTuple):
    """Assumptions of a drop's analysis: arguments of `chain_records`."""

    protocol: Protocol
    run: Run
    hz: float
    aside: tuple[int, ...] = ()


@dataclass(frozen=True)
class Shift:
    """Change of a protocol's values by a fault of size 1.

    Attributes
    ----------
    drop, clock, gravity
        Change of the drop height, m, of the clock's relative rate, and of gravity, m/s².
    gates
        Change of each gate's height, m; empty for none.
    chains
        Names of the chains that are longer or thicker.
    length, width
        Relative change of their length, and change of their rods' width, m.
    """

    drop: float = 0.0
    clock: float = 0.0
    gravity: float = 0.0
    gates: tuple[float, ...] = ()
    chains: frozenset[str] = frozenset()
    length: float = 0.0
    width: float = 0.0

    def premise(self, stated: Premise, size: float) -> Premise:
        """Return the stated premise changed by a fault of some size."""
        protocol, placed = stated.protocol, _gates_of(stated.protocol)
        drop, gravity = protocol.drop, protocol.gravity
        gates = tuple(
            replace(gate, height=gate.height + size * shift)
            for gate, shift in zip(placed.gates, self.gates or repeat(0.0), strict=False)
        )
        changed = replace(
            protocol,
            drop=replace(drop, value=drop.value + size * self.drop),
            gravity=replace(gravity, value=gravity.value + size * self.gravity),
            gates=replace(placed, gates=gates),
        )
        moved = stated._replace(protocol=changed, hz=stated.hz * (1.0 - size * self.clock))
        return _with_chains(self.chains, self._resize_chain)(moved, size)

    def _resize_chain(self, chain: RodChain, size: float) -> RodChain:
        heights = [height * (1.0 + size * self.length) for height in chain.chain.heights]
        widths = tuple(width + size * self.width for width in chain.widths)
        return replace(_with_rods(chain, range(len(heights)), heights), widths=widths)

    def direction(self, model: DropModel) -> Array:
        """Return the change of a drop's unknowns by a fault of size 1, shape ``(unknowns,)``."""
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
    """A way in which a rig may differ from its protocol.

    Attributes
    ----------
    code
        Code of the reason that names the fault.
    where
        Values of the reason that do not depend on the size: chain, gate or side.
    symbol, unit, scale, offset
        Name of the size in the reason, the suffix of its unit, and the factor and offset to
        convert it; no symbol for a fault without a size.
    sizes
        Sizes tried first, at intervals that identification tolerates.
    shift
        For a continuous size: the change by a fault of size 1.
    exchange
        For a discrete size: function that returns the changed premise.
    of_air
        Whether the size is κ, which is fitted if the protocol does not state drag.
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
        """Return the values of the reason that names the fault; `u` is 0 for a count."""
        values = dict(self.where)
        if self.symbol:
            values[f"{self.symbol}{self.unit}"] = self.offset + self.scale * size
        if u:
            values[f"U95{self.unit}"] = 2.0 * self.scale * u
        return values

    def premise(self, stated: Premise, size: float) -> Premise:
        """Return the stated premise changed by a fault of some size."""
        return (self.shift.premise if self.shift else self.exchange)(stated, size)

    def suspect(self, model: DropModel) -> Unknown:
        """Return the size as a further unknown, with a normal prior for the range of sizes.

        The prior's density at its mean is that of a uniform distribution over the range, whose
        width is √(2π) standard deviations.
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
    """Return all distinguishable faults of a scene.

    Parameters
    ----------
    suspect
        Numbers of the gates of which any two may be exchanged.
    """
    gates = _gates_of(protocol).gates
    exchanges = [_exchange(gates, a, b) for a, b in combinations(suspect, 2)]
    chains, rig = _chain_faults(protocol, run), _rig_faults(protocol)
    return [*chains, *rig, *_gate_faults(gates), *exchanges]


def _sized_fault(
    code: str, shift: Shift, limit: float, step: float, *names: str, scale: float = 1, **where: Any
) -> Fault:
    """Return a fault of any size up to ±`limit`, tried in steps; by default a length."""
    count = math.ceil(limit / step)
    sizes = tuple(step * n for n in range(-count, count + 1) if n)
    symbol, unit = names or ("size", "_m")
    return Fault(code, where, symbol, unit, scale, sizes=sizes, shift=shift)


def _chain_faults(protocol: Protocol, run: Run) -> Iterator[Fault]:
    """Yield the faults of each chain, of both chains together, and of their places."""
    names = {role: name for role, name in (("impact", run.impact), ("free", run.free)) if name}
    groups = [(frozenset({name}), name) for name in names.values()]
    if len(names) > 1:
        groups.append((frozenset(names.values()), ""))
    for group, name in groups:
        chain = protocol.chains[min(group)]
        top, rods = chain.chain.heights[-1], chain.chain.rods
        if rods > 1:  # a single object has neither length nor missing rods
            longer = Shift(chains=group, length=1.0)
            yield _sized_fault("chain_length", longer, 0.06, 0.015, scale=top, name=name)
            yield Fault(
                "rod_count",
                {"name": name, "stated": rods},
                "rods",
                offset=rods,
                sizes=tuple(n for n in range(-_MORE, _MORE + 1) if n and rods + n >= 2),
                exchange=_with_chains(group, _with_more),
            )
        limit = _WIDER * min(chain.widths)
        yield _sized_fault("thickness", Shift(chains=group, width=1.0), limit, limit, name=name)
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
    """Yield the faults of everything that both chains share."""
    yield _sized_fault("drop_height", Shift(drop=1.0), 60e-3, 10e-3)
    yield _sized_fault("clock", Shift(clock=1.0), 0.05, 0.01, "share", "")
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
        # Without a surface there is no contact point, and gravity is the measurand.
        gates = _gates_of(protocol).gates
        yield _height_fault("all_gates", gates, gates)
        gravity = Shift(gravity=protocol.gravity.value)
        yield _sized_fault("gravity", gravity, 0.10, 0.02, "share", "")


def _gate_faults(gates: Sequence[Gate]) -> Iterator[Fault]:
    """Yield the faults of each post with several gates, and of each gate."""
    sides = [gate.side for gate in gates]
    for side in dict.fromkeys(sides):
        if 1 < sides.count(side) < len(sides):
            post = [gate for gate in gates if gate.side == side]
            yield _height_fault("post", gates, post, side=side)
    for gate in gates if len(gates) > 1 else ():
        yield _height_fault("gate_height", gates, [gate], **gate_values(gate))


def _height_fault(code: str, gates: Sequence[Gate], wrong: Collection[Gate], **where: Any) -> Fault:
    shift = Shift(gates=tuple(float(gate in wrong) for gate in gates))
    return _sized_fault(code, shift, 40e-3, 10e-3, **where)


def _gates_of(protocol: Protocol) -> Gates:
    assert protocol.gates is not None
    return protocol.gates


def _exchange(gates: Sequence[Gate], a: int, b: int) -> Fault:
    def exchange(stated: Premise, _: float) -> Premise:
        protocol, changed = stated.protocol, [*gates]
        changed[a] = replace(gates[a], channel=gates[b].channel)
        changed[b] = replace(gates[b], channel=gates[a].channel)
        placed = replace(_gates_of(protocol), gates=tuple(changed))
        return stated._replace(protocol=replace(protocol, gates=placed))

    both = [gate_values(gates[a]), gate_values(gates[b])]
    return Fault("gates_exchanged", {"at": both}, exchange=exchange)


def gate_values(gate: Gate) -> dict[str, Any]:
    """Return the values by which a reason names a gate: channel, side and stated height."""
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
    """Return a chain of the rods numbered `order`, at other heights above the lowest, m."""

    def chosen(values: tuple[float, ...]) -> tuple[float, ...]:
        return tuple(values[n] for n in order)

    hung = replace(chain.chain, masses=chosen(chain.chain.masses), heights=tuple(heights))
    widths, diameters = chosen(chain.widths), chosen(chain.diameters)
    return replace(chain, chain=hung, widths=widths, diameters=diameters)


def _with_more(chain: RodChain, count_more: float) -> RodChain:
    """Return a chain with rods like the top rod added at the top, or with rods removed."""
    heights, count = chain.chain.heights, chain.chain.rods + round(count_more)
    top, pitch = len(heights) - 1, heights[-1] - heights[-2] if len(heights) > 1 else 0.0
    order = [min(n, top) for n in range(count)]
    return _with_rods(chain, order, [heights[k] + pitch * (n - k) for n, k in enumerate(order)])


def upside_down(chain: RodChain) -> RodChain | None:
    """Return a chain upside down; `None` if that makes no difference."""
    heights = chain.chain.heights
    turned = [heights[-1] - height for height in heights[::-1]]
    alike = all(abs(a - b) < 1e-3 for a, b in zip(turned, heights, strict=True))
    if alike and chain.widths[::-1] == chain.widths:
        return None
    return _with_rods(chain, range(len(heights))[::-1], turned)
