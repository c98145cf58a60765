"""What may be wrong with a drop that does not look like its chains falling."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from typing import TYPE_CHECKING

from rig.analysis.faults import exchanged
from rig.analysis.pattern import guess
from rig.analysis.sides import sides_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.analysis.pattern import Guess
    from rig.analysis.trains import Side, Train
    from rig.protocol.protocol import Protocol, RodChain, Run
    from rig.records import Drop

CONVINCING = 0.85
"""Share of the expected edges that must be where a suspicion puts them."""
_LEAD = 0.1  # by which it must exceed the next best


def suspects(
    protocol: Protocol,
    run: Run,
    drop: Drop,
    hz: float,
    sides: Sequence[Side],
    unlike: Sequence[str],
) -> list[str]:
    """Try one fault after another on each side that is unlike its chain, and say which one fits.

    Parameters
    ----------
    hz
        Of the drop's ticks.
    sides
        As the protocol has them.
    unlike
        Roles of those that do not look like it.
    """
    found: list[str] = []
    for role, side in ((side.role, side) for side in sides if side.role in unlike):
        turned = upside_down(side.chain)
        if turned is not None:
            other = replace(protocol, chains={**protocol.chains, side.chain.name: turned})
            (again,) = (s for s in sides_of(other, run, drop, hz) if s.role == role)
            if _convincing(_guess(protocol, again)):
                found.append(f"chain {side.chain.name} hangs upside down on the {role} side")
                continue
        found += _plugs(protocol, side)
    return found


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


def _plugs(protocol: Protocol, side: Side) -> list[str]:
    """Look for the one pair of gates that makes sense when exchanged."""
    assert protocol.gates is not None
    tried = []
    for a, b in combinations(range(len(side.trains)), 2):
        trains = list(side.trains)
        trains[a], trains[b] = _saw(trains[a], trains[b]), _saw(trains[b], trains[a])
        tried.append((_guess(protocol, replace(side, trains=tuple(trains))), a, b))
    tried.sort(key=lambda one: -one[0].share)
    if not tried or not _convincing(tried[0][0]):
        return []
    if len(tried) > 1 and tried[0][0].share - tried[1][0].share < _LEAD:
        return []
    gates = protocol.gates.gates
    _, a, b = tried[0]
    return [exchanged(gates[side.trains[a].gate], gates[side.trains[b].gate])]


def _saw(train: Train, other: Train) -> Train:
    """Give a gate the edges of another."""
    return replace(
        train, times=other.times, blocked=other.blocked, burst=other.burst, edge=other.edge
    )


def _guess(protocol: Protocol, side: Side) -> Guess:
    return guess(side, protocol.drop, protocol.gravity.value)


def _convincing(one: Guess) -> bool:
    return one.share >= CONVINCING and one.share - one.runner_up >= _LEAD
