"""DueEdges of a single object through the gates: speed, and interval since the previous gate."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rig.analysis.dual import Dual
from rig.analysis.fit import DropFit
from rig.analysis.quantities import AdjustedDrop
from rig.analysis.result import Measured
from rig.plain_data import Record
from rig.protocol.protocol import Gate


@dataclass(frozen=True, slots=True)
class GatePassage(Record):
    """Passage of an object's middle through a beam.

    Attributes
    ----------
    channel, height_m
        Channel and height of the gate by the protocol.
    speed
        Speed along its path, m/s.
    interval
        Time since the previous gate, s; `None` at the first, or if the previous saw nothing.
    """

    MEMBERS = "channel height_m speed_m_s=speed interval_s=interval?"

    channel: int
    height_m: float
    speed: Measured
    interval: Measured | None


def gate_passages(fit: DropFit, measured: Callable[[Dual], Measured]) -> tuple[GatePassage, ...]:
    """Return the passage of every gate that saw the object, from the top down.

    Parameters
    ----------
    fit
        Fit of the drop.
    measured
        Function that returns a result for a value with its derivatives.

    Returns
    -------
    tuple of GatePassage
        Empty for chains, whose rods pass a gate many times, and for a striking object.
    """
    model, drop = fit.model, AdjustedDrop(fit.model, fit.x)
    if not model.protocol.one_object or "free" not in model.records:
        return ()
    gates = model.protocol.gates
    seen = {*model.records["free"].due.gate[fit.matches["free"] >= 0].tolist()}
    passages: list[GatePassage] = []
    before: Dual | None = None
    for n, gate in sorted(enumerate(gates.gates), key=lambda numbered: -numbered[1].height):
        if n not in seen:
            before = None
            continue
        when, speed = moment(drop, gate)
        interval = None if before is None else measured(when - before)
        passages.append(GatePassage(gate.channel, gate.height, measured(speed), interval))
        before = when
    return tuple(passages)


def moment(drop: AdjustedDrop, gate: Gate) -> tuple[Dual, Dual]:
    """Return the time and speed of the object's middle at the fitted height of a beam."""
    model, gates = drop.model, drop.model.protocol.gates
    beam, post = np.eye(len(gates.gates)), np.eye(len(gates.posts))
    level = gate.height + drop.linear("beams", beam[[gates.gates.index(gate)]])
    level += drop.linear("datum", post[[gates.posts.index(gate.side)]])
    level -= drop.linear("free rods", np.ones((1, 1)))
    speed = drop.squares("free", level).root()
    times = model.trajectory("free", drop.x).times(level.value)
    reached = Dual(times, np.zeros_like(level.slopes))
    return (reached + (drop.levels("free", reached) - level) / speed)[0], speed[0]
