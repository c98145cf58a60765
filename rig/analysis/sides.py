"""Both chains of a drop, each with the trains of its gates, and a first guess of their falls."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from rig.analysis.pattern import NO_AIR, Air, guess
from rig.analysis.trains import Edges, Side, train
from rig.analysis.unknowns import DRAG_U
from rig.model.fall import kicks
from rig.model.rods import rod_impacts

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from rig.analysis.pattern import Guess
    from rig.analysis.trains import Train
    from rig.model.chain import Chain
    from rig.protocol.protocol import Protocol, RodChain, Run
    from rig.records import Drop

    Array = NDArray[np.float64]

_FELT = 2e-3  # 1/m: less than a millimetre in a first guess


def sides_of(protocol: Protocol, run: Run, drop: Drop, hz: float) -> list[Side]:
    """Collect each chain with the trains of its gates."""
    return [
        Side(role, chain, trains, _ratios(protocol, chain.chain) if role == "impact" else None)
        for role, chain, trains in trains_of(protocol, run, Edges.of(drop, hz))
    ]


def trains_of(
    protocol: Protocol, run: Run, edges: Edges
) -> Iterator[tuple[Literal["impact", "free"], RodChain, tuple[Train, ...]]]:
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
        trains = (train(n, gate, chain, edges, start, role == "impact") for n, gate in gates)
        yield role, chain, tuple(trains)


def guesses_of(protocol: Protocol, sides: Sequence[Side]) -> dict[str, Guess]:
    """Guess each side's fall."""
    gravity, start = protocol.gravity.value, protocol.drop
    # The free chain tells what the air does to both.
    air = Air(0.0, DRAG_U) if air_is_told(sides) else NO_AIR
    found: dict[str, Guess] = {}
    for side in reversed(sides):
        found[side.role] = guess(side, start, gravity, air)
        kappa = found[side.role].kappa
        air = Air(kappa) if abs(kappa) > _FELT else NO_AIR
    return {side.role: found[side.role] for side in sides}


def air_is_told(sides: Sequence[Side]) -> bool:
    """Whether κ can be told from what is struck: by a free chain, of rods that are all alike."""
    return len(sides) > 1 and all(side.chain.chain.alike for side in sides)


def _ratios(protocol: Protocol, chain: Chain) -> Array:
    """ΔV/V of each impact for α = 1, Eq. 9."""
    assert protocol.surface is not None
    # γ is the same at every incline, and level ground is always inside the domain of Eq. 13.
    gammas = [impact.gamma for impact in rod_impacts(protocol.surface, chain, 0.0)]
    return np.array(kicks(chain, [1.0] * chain.rods, gammas))
