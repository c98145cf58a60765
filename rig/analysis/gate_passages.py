"""One object at each gate: how fast it passed, and how long after the gate before."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rig.analysis.free_flight import reach_slopes
from rig.analysis.trajectory import COMMON, DRAG, GRAVITY, START

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from rig.analysis.drop_model import DropModel
    from rig.analysis.fit import Matched
    from rig.analysis.result import Measured
    from rig.protocol.protocol import Gate

    Array = NDArray[np.float64]


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
        found: dict[str, Any] = {"channel": self.channel, "height_m": self.height_m}
        found["speed_m_s"] = self.speed.json()
        if self.interval is not None:
            found["interval_s"] = self.interval.json()
        return found


class _Moment(NamedTuple):
    """Time and speed in a beam, each with its derivatives by all unknowns."""

    gate: Gate
    time: float
    d_time: Array
    speed: float
    d_speed: Array


def gate_passages(
    fit: Matched, x: Array, measured: Callable[[float, Array], Measured]
) -> tuple[GatePassage, ...]:
    """Say of every gate that saw the object how it passed, in the order of its way.

    Parameters
    ----------
    fit
        Of one drop.
    x
        Its unknowns.
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
    moments = [_moment(model, gate, x) if gate in seen else None for gate in ordered]
    return tuple(
        GatePassage(
            now.gate.channel,
            now.gate.height,
            measured(now.speed, now.d_speed),
            measured(now.time - last.time, now.d_time - last.d_time) if last else None,
        )
        for last, now in pairwise([None, *moments])
        if now is not None
    )


def _moment(model: DropModel, gate: Gate, x: Array) -> _Moment:
    """When the object's middle is in a beam, where that beam really is."""
    at, gates = model.unknowns, model.protocol.gates
    assert gates is not None
    d_level = np.zeros(x.size)
    d_level[at["beams"].start + gates.gates.index(gate)] = 1.0
    d_level[at["datum"].start + gates.posts.index(gate.side)] = 1.0
    d_level[at["free rods"]] = -1.0
    level = gate.height + float(d_level @ x)
    path = model.trajectory("free", x)
    when = path.times(np.array([level]))
    _, (speed,), slopes = path.sights(when)
    d_time = (model.spread("free", slopes)[0] - d_level) / speed
    # v² = g (1 − e^(−2κd))/κ after a way d from rest.
    way, share = np.array([path.height[0] - level]), float(path.air[0])
    kappa = path.kappa * share
    reach, by_kappa = reach_slopes(way, kappa)
    steeper = (path.gravity - kappa * speed**2) / speed
    by_path = np.zeros(COMMON)
    by_path[START] = steeper
    by_path[GRAVITY] = reach[0] / (2.0 * speed)
    by_path[DRAG] = share * path.gravity * by_kappa[0] / (2.0 * speed)
    d_speed = model.spread("free", by_path) - steeper * d_level
    return _Moment(gate, float(when[0]), d_time, float(speed), d_speed)
