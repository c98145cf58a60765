"""What may be otherwise at a rig than its protocol says: one thing each, of some size.

A fault is a change of what a drop is read with, and the reason that names it.
`rig.analysis.explanations` weighs faults against each other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rig.units import Quantity

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from rig.analysis.drop_model import DropModel
    from rig.protocol.protocol import Gate, Gates, Protocol, RodChain, Run

    Array = NDArray[np.float64]

_MORE = 3  # rods by which a chain may differ
_WIDER = 0.5  # of its thinnest rod, by which rods may look thicker or thinner


class Premise(NamedTuple):
    """What a drop is read with."""

    protocol: Protocol
    run: Run
    hz: float


@dataclass(frozen=True)
class Fault:
    """One way in which a rig may differ from its protocol.

    Attributes
    ----------
    change
        The setting as it is with a fault of some size.
    code
        Of the reason that names it.
    values
        Of that reason, given size and standard uncertainty.
    sizes
        Tried at first; apart by no more than what a reading tolerates.
    shift
        Where sizes between them count too: what a fault of size 1 does to each of a drop's
        unknowns, by their blocks.
    of_air
        Whether its size is κ, which every drop tells that is not told of the air.
    """

    change: Callable[[Premise, float], Premise]
    code: str
    values: Callable[[float, float], dict[str, Any]]
    sizes: tuple[float, ...] = (0.0,)
    shift: Callable[[DropModel], Mapping[str, float | Array]] | None = None
    of_air: bool = False

    def direction(self, model: DropModel) -> Array:
        """What a fault of size 1 does to all unknowns, shape ``(unknowns,)``."""
        assert self.shift is not None
        found = np.zeros(len(model.unknowns))
        for name, by in self.shift(model).items():
            found[model.unknowns[name]] = by
        return found


def faults(protocol: Protocol, run: Run, suspect: Sequence[int]) -> list[Fault]:
    """All faults that a scene may have and that could be told from each other.

    Parameters
    ----------
    suspect
        Numbers of the gates of which any two may be exchanged.
    """
    placed = _placed(protocol)
    gates = placed.gates
    sides = [placed.on(post) for post in placed.posts]
    found = [*_chain_faults(protocol, run), *_rig_faults(protocol)]
    if len(sides) > 1:
        found += [_post(side[0].side) for side in sides if len(side) > 1]
    if len(gates) > 1:
        found += [_gate_off(n, gate) for n, gate in enumerate(gates)]
    found += [_exchange(gates, a, b) for a, b in combinations(suspect, 2)]
    return found


def _grid(limit: float, step: float) -> tuple[float, ...]:
    count = math.ceil(limit / step)
    return tuple(step * n for n in range(-count, count + 1) if n)


def _chain_faults(protocol: Protocol, run: Run) -> Iterator[Fault]:
    """Faults of each chain, of both where they are alike, and of their places."""
    names = {role: name for role, name in (("impact", run.impact), ("free", run.free)) if name}
    groups = [({name}, name) for name in names.values()]
    if len(names) > 1:
        groups.append((set(names.values()), ""))
    for group, name in groups:
        one = protocol.chains[next(iter(group))]
        if one.chain.rods > 1:  # one object has no length, and is no chain with rods missing
            yield _length(group, name, one.chain.heights[-1])
            yield _rods(group, name, one.chain.rods)
        yield _thickness(group, name, min(one.widths))
    for role, name in names.items():
        if upside_down(protocol.chains[name]) is not None:
            yield _turned(name, role)
    if len(names) > 1 and protocol.unlike_chains:
        yield Fault(
            lambda setting, _: setting._replace(
                run=replace(setting.run, impact=setting.run.free, free=setting.run.impact)
            ),
            "chains_exchanged",
            lambda _s, _u: {"impact": run.impact, "free": run.free},
        )


def _length(names: set[str], name: str, top: float) -> Fault:
    return Fault(
        _with_chains(names, _stretched),
        "chain_length",
        lambda s, u: {"name": name, "size_m": s * top, "U95_m": 2.0 * u * top},
        _grid(0.06, 0.015),
        lambda model: {
            f"{role} rods": np.array(record.chain.chain.heights)
            for role, record in model.records.items()
            if record.chain.name in names
        },
    )


def _rods(names: set[str], name: str, rods: int) -> Fault:
    counts = tuple(float(n) for n in range(-_MORE, _MORE + 1) if n and rods + n >= 2)
    return Fault(
        _with_chains(names, _with_more),
        "rod_count",
        lambda n, _: {"name": name, "rods": rods + round(n), "stated": rods},
        counts,
    )


def _thickness(names: set[str], name: str, width: float) -> Fault:
    return Fault(
        _with_chains(names, _widened),
        "thickness",
        lambda d, u: {"name": name, **_size(d, u)},
        (-_WIDER * width, _WIDER * width),
        lambda model: {
            f"{role} width": 1.0
            for role, record in model.records.items()
            if record.chain.name in names
        },
    )


def _turned(name: str, role: str) -> Fault:
    return Fault(
        _with_chains({name}, lambda chain, _: upside_down(chain) or chain),
        "upside_down",
        lambda _s, _u: {"name": name, "side": role},
    )


def _rig_faults(protocol: Protocol) -> Iterator[Fault]:
    """Faults of everything that both chains share."""
    yield Fault(
        lambda setting, d: _protocol(
            setting,
            drop=Quantity(setting.protocol.drop.value + d, setting.protocol.drop.u),
        ),
        "drop_height",
        _size,
        _grid(60e-3, 10e-3),
        lambda _: {"drop": 1.0},
    )
    yield Fault(
        lambda setting, e: setting._replace(hz=setting.hz * (1.0 - e)),
        "clock",
        _share,
        _grid(0.05, 0.01),
        lambda _: {"clock": 1.0},
    )
    if protocol.drag is not None:
        yield Fault(
            lambda setting, _: _protocol(setting, drag=None),
            "air",
            lambda kappa, u: {"kappa": kappa, "U95": 2.0 * u},
            of_air=True,
        )
    if protocol.surface is None:
        return  # from beam to beam nobody knows the contact point, and gravity is what is measured
    yield Fault(
        lambda setting, c: _moved(setting, c, lambda _gate: True),
        "all_gates",
        _size,
        _grid(40e-3, 10e-3),
        lambda _: {"datum": 1.0},
    )
    yield Fault(
        lambda setting, e: _protocol(
            setting,
            gravity=Quantity(
                setting.protocol.gravity.value * (1.0 + e), setting.protocol.gravity.u
            ),
        ),
        "gravity",
        _share,
        _grid(0.10, 0.02),
        lambda model: {"gravity": model.protocol.gravity.value},
    )


def _post(side: str) -> Fault:
    return Fault(
        lambda setting, c: _moved(setting, c, lambda gate: gate.side == side),
        "post",
        lambda c, u: {"side": side, **_size(c, u)},
        _grid(40e-3, 10e-3),
        lambda model: {"datum": np.array(_placed(model.protocol).posts) == side},
    )


def _gate_off(number: int, gate: Gate) -> Fault:
    return Fault(
        lambda setting, c: _moved(setting, c, lambda one: one.channel == gate.channel),
        "gate_height",
        lambda c, u: {**gate_values(gate), **_size(c, u)},
        _grid(40e-3, 10e-3),
        lambda model: {"beams": np.eye(len(_placed(model.protocol).gates))[number]},
    )


def _placed(protocol: Protocol) -> Gates:
    assert protocol.gates is not None
    return protocol.gates


def _exchange(gates: Sequence[Gate], a: int, b: int) -> Fault:
    def change(setting: Premise, _: float) -> Premise:
        found = list(gates)
        found[a] = replace(gates[a], channel=gates[b].channel)
        found[b] = replace(gates[b], channel=gates[a].channel)
        return _with_gates(setting, found)

    both = [gate_values(gates[a]), gate_values(gates[b])]
    return Fault(change, "gates_exchanged", lambda _s, _u: {"at": both})


def gate_values(gate: Gate) -> dict[str, Any]:
    """Return the values by which a reason names a gate, so that one can find it."""
    height = gate.height if gate.stated is None else gate.stated
    return {"channel": gate.channel, "side": gate.side, "height_m": height}


def _protocol(setting: Premise, **changes: object) -> Premise:
    return setting._replace(protocol=replace(setting.protocol, **changes))  # type: ignore[arg-type]


def _with_gates(setting: Premise, gates: Sequence[Gate]) -> Premise:
    return _protocol(setting, gates=replace(_placed(setting.protocol), gates=tuple(gates)))


def _moved(setting: Premise, by: float, which: Callable[[Gate], bool]) -> Premise:
    moved = [
        replace(one, height=one.height + by) if which(one) else one
        for one in _placed(setting.protocol).gates
    ]
    return _with_gates(setting, moved)


def _with_chains(
    names: set[str], other: Callable[[RodChain, float], RodChain]
) -> Callable[[Premise, float], Premise]:
    def change(setting: Premise, size: float) -> Premise:
        chains = {
            name: other(chain, size) if name in names else chain
            for name, chain in setting.protocol.chains.items()
        }
        return _protocol(setting, chains=chains)

    return change


def _stretched(chain: RodChain, by: float) -> RodChain:
    heights = tuple(height * (1.0 + by) for height in chain.chain.heights)
    return replace(chain, chain=replace(chain.chain, heights=heights))


def _widened(chain: RodChain, by: float) -> RodChain:
    return replace(chain, widths=tuple(width + by for width in chain.widths))


def _with_more(chain: RodChain, more: float) -> RodChain:
    """Add rods like the top one at the top, or take some off."""
    rods, extra = chain.chain, round(more)
    if extra < 0:
        kept = slice(0, rods.rods + extra)
        inertias = rods.inertias and rods.inertias[kept]
        less = replace(
            rods, masses=rods.masses[kept], heights=rods.heights[kept], inertias=inertias
        )
        return replace(
            chain, chain=less, widths=chain.widths[kept], diameters=chain.diameters[kept]
        )
    pitch = rods.heights[-1] - rods.heights[-2] if rods.rods > 1 else 0.0
    added = tuple(rods.heights[-1] + pitch * (n + 1) for n in range(extra))
    inertias = rods.inertias and rods.inertias + rods.inertias[-1:] * extra
    longer = replace(
        rods,
        masses=rods.masses + rods.masses[-1:] * extra,
        heights=rods.heights + added,
        inertias=inertias,
    )
    return replace(
        chain,
        chain=longer,
        widths=chain.widths + chain.widths[-1:] * extra,
        diameters=chain.diameters + chain.diameters[-1:] * extra,
    )


def upside_down(chain: RodChain) -> RodChain | None:
    """Turn a chain round; `None` where that makes no difference."""
    rods = chain.chain
    top = rods.heights[-1]
    heights = tuple(top - height for height in rods.heights[::-1])
    widths = chain.widths[::-1]
    alike = all(abs(a - b) < 1e-3 for a, b in zip(heights, rods.heights, strict=True))
    if alike and widths == chain.widths:
        return None
    inertias = rods.inertias and rods.inertias[::-1]
    turned = replace(rods, masses=rods.masses[::-1], heights=heights, inertias=inertias)
    return replace(chain, chain=turned, widths=widths)


def _size(metres: float, u: float) -> dict[str, Any]:
    return {"size_m": metres, "U95_m": 2.0 * u}


def _share(share: float, u: float) -> dict[str, Any]:
    return {"share": share, "U95": 2.0 * u}
