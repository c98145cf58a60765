"""One object at each gate: how fast it passed, and how long after the gate before."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.analysis.dual import Dual
from rig.analysis.plain_data import attributes

if TYPE_CHECKING:
    from collections.abc import Callable

    from rig.analysis.fit import Matched
    from rig.analysis.quantities import Adjusted
    from rig.analysis.result import Measured
    from rig.protocol.protocol import Gate


@dataclass(frozen=True, slots=True)
class GatePassage:
    """One object's middle in one beam.

    Attributes
    ----------
    channel, height_m
        Of the gate, as the protocol has them.
    speed
        Down its way, m/s.
    interval
        Since it passed the gate before, s; `None` at the first one, and where that one saw nothing.
    """

    channel: int
    height_m: float
    speed: Measured
    interval: Measured | None

    def json(self) -> dict[str, Any]:
        """One member of ``gates`` of a run."""
        fields = attributes(self, "channel", "height_m") | {"speed_m_s": self.speed.json()}
        return fields if self.interval is None else fields | {"interval_s": self.interval.json()}


def gate_passages(
    fit: Matched, drop: Adjusted, measured: Callable[[Dual], Measured]
) -> tuple[GatePassage, ...]:
    """Say of every gate that saw the object how it passed, in the order of its way.

    Parameters
    ----------
    fit
        Of one drop.
    drop
        The same, with its unknowns.
    measured
        Makes a result of a value and its derivatives by the unknowns.

    Returns
    -------
    tuple of GatePassage
        Empty for chains, whose rods pass a gate many times, and for what strikes.
    """
    model = fit.model
    if not model.protocol.one_object or "free" not in model.records:
        return ()
    gates = model.protocol.gates
    assert gates is not None
    seen = {
        gates.gates[train.gate]
        for train, match in zip(model.records["free"].trains, fit.matches["free"], strict=True)
        if (match >= 0).any()
    }
    ordered = sorted(gates.gates, key=lambda gate: -gate.height)
    moments = [(gate, *moment(drop, gate)) if gate in seen else None for gate in ordered]
    return tuple(
        GatePassage(
            passage[0].channel,
            passage[0].height,
            measured(passage[2]),
            measured(passage[1] - last[1]) if last else None,
        )
        for last, passage in pairwise([None, *moments])
        if passage is not None
    )


def moment(drop: Adjusted, gate: Gate) -> tuple[Dual, Dual]:
    """When the object's middle is in a beam, where that beam really is, and how fast it is."""
    model, gates = drop.model, drop.model.protocol.gates
    assert gates is not None
    beam, post = np.eye(len(gates.gates)), np.eye(len(gates.posts))
    level = gate.height + drop.linear("beams", beam[[gates.gates.index(gate)]])
    level += drop.linear("datum", post[[gates.posts.index(gate.side)]])
    level -= drop.linear("free rods", np.ones((1, 1)))
    speed = drop.squares("free", level).root()
    times = model.trajectory("free", drop.x).times(level.value)
    late = drop.levels("free", Dual(times, np.zeros_like(level.slopes))) - level
    return (Dual(times, np.zeros_like(level.slopes)) + late / speed)[0], speed[0]
