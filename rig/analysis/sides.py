"""Both chains of a drop, each with the trains of its gates, and a first guess of their falls."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.pattern import guess
from rig.analysis.trains import Edges, Side, train
from rig.model.fall import kicks
from rig.model.rods import rod_impacts

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from rig.analysis.pattern import Guess
    from rig.model.chain import Chain
    from rig.protocol.scene import Protocol, Run
    from rig.records import Drop

    Array = NDArray[np.float64]


def sides_of(protocol: Protocol, run: Run, drop: Drop, hz: float) -> list[Side]:
    """Collect each chain with the trains of its gates."""
    assert protocol.gates is not None
    edges = Edges.of(drop, hz)
    start = protocol.drop.value
    sides = []
    for role in ("impact", "free"):
        name = run.impact if role == "impact" else run.free
        gates = [(n, gate) for n, gate in enumerate(protocol.gates.gates) if gate.side == role]
        if name is None or not gates:
            continue
        chain = protocol.chains[name]
        trains = [train(n, g, chain, edges, start, role == "impact") for n, g in gates]
        ratios = _ratios(protocol, chain.chain) if role == "impact" else None
        sides.append(Side(role, chain, tuple(trains), ratios))
    return sides


def guesses_of(protocol: Protocol, sides: Sequence[Side]) -> dict[str, Guess]:
    """Guess each side's fall."""
    gravity = protocol.gravity.value
    return {side.role: guess(side, protocol.drop, gravity) for side in sides}


def _ratios(protocol: Protocol, chain: Chain) -> Array:
    """ΔV/V of each impact for α = 1, Eq. 9."""
    assert protocol.surface is not None
    # γ is the same at every incline, and level ground is always inside the domain of Eq. 13.
    gammas = [impact.gamma for impact in rod_impacts(protocol.surface, chain, 0.0)]
    return np.array(kicks(chain, [1.0] * chain.rods, gammas))
