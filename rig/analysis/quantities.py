"""The measurands, as functions of the adjusted unknowns, with their uncertainty."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.adjust import uncertainty
from rig.analysis.result import Measured

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from rig.analysis.adjust import Estimate
    from rig.analysis.drop_model import DropModel

    Array = NDArray[np.float64]
    Value = tuple[float, Array]


def quantities(model: DropModel, estimate: Estimate) -> dict[str, Measured]:
    """Return everything the scene lets one measure, by its JSON name."""
    return {
        name: _measured(model, estimate, value, gradient)
        for name, (value, gradient) in measurands(model, estimate.x).items()
    }


def measurands(model: DropModel, x: Array) -> dict[str, Value]:
    """Return the value of each measurand of the scene and its derivatives by all unknowns."""
    found = ((name, compute(model, x)) for name, compute in COMPUTED.items())
    return {name: value for name, value in found if value is not None}


def _measured(model: DropModel, estimate: Estimate, value: float, gradient: Array) -> Measured:
    u, budget = uncertainty(estimate, gradient, model.unknowns.groups)
    return Measured(value, u, max(1.0, estimate.degrees), budget)


def _gravity(model: DropModel, x: Array) -> Value | None:
    """The acceleration of a chain that strikes nothing."""
    if "impact" in model.records:
        return None
    gradient = np.zeros(x.size)
    gradient[model.unknowns["gravity"]] = 1.0
    return model.protocol.gravity.value + float(x[model.unknowns["gravity"]][0]), gradient


def _speed(model: DropModel, x: Array) -> Value | None:
    """V just before the top rod strikes."""
    if "impact" not in model.records:
        return None
    path = model.trajectory("impact", x)
    return path.arrival, model.spread("impact", path.d_arrival)


def _fall_time(model: DropModel, x: Array) -> Value | None:
    """How long it takes until the top rod strikes."""
    if "impact" not in model.records:
        return None
    path = model.trajectory("impact", x)
    duration = model.spread("impact", path.d_time[-1])
    duration[model.unknowns["impact release"]] = 0.0  # it moves both ends
    return float(path.time[-1] - path.time[0]), duration


def _release_skew(model: DropModel, x: Array) -> Value | None:
    """The free chain's release less the impact chain's."""
    if not _both(model):
        return None
    gradient = np.zeros(x.size)
    gradient[model.unknowns["free release"]] = 1.0
    gradient[model.unknowns["impact release"]] = -1.0
    begins = [float(model.trajectory(role, x).time[0]) for role in ("free", "impact")]
    return begins[0] - begins[1], gradient


def _separation_raw(model: DropModel, x: Array) -> Value | None:
    """Δz at the instant of the top rod's strike."""
    if not _both(model):
        return None
    struck = model.trajectory("impact", x)
    return _apart(model, x, float(struck.time[-1]), model.spread("impact", struck.d_time[-1]))


def _separation(model: DropModel, x: Array) -> Value | None:
    """Δz had both chains been let go together: the free one that much later, or earlier."""
    skew = _release_skew(model, x)
    if skew is None:
        return None
    struck = model.trajectory("impact", x)
    hit, d_hit = float(struck.time[-1]), model.spread("impact", struck.d_time[-1])
    # The free chain is read off where it was as long after its own release: no model of what it
    # would have done comes in.
    return _apart(model, x, hit + skew[0], d_hit + skew[1])


def _both(model: DropModel) -> bool:
    return {"impact", "free"} <= set(model.records)


def _apart(model: DropModel, x: Array, when: float, d_when: Array) -> Value:
    """Height of the free chain's top rod above the contact point at a moment."""
    free, at = model.trajectory("free", x), model.unknowns
    top = model.records["free"].chain.chain.length + float(x[at["free rods"]][-1])
    height, speed = free.heights(np.array([when]))
    gradient = model.spread("free", free.derivatives(np.array([when])))[0]
    gradient[at["free rods"].stop - 1] += 1.0  # the top rod is measured, not the reference point
    return float(height[0]) + top, gradient - float(speed[0]) * d_when


COMPUTED: dict[str, Callable[[DropModel, Array], Value | None]] = {
    "separation_m": _separation,
    "separation_raw_m": _separation_raw,
    "release_skew_s": _release_skew,
    "speed_m_s": _speed,
    "fall_time_s": _fall_time,
    "gravity_m_s2": _gravity,
}
"""How each row of `rig.measurands` follows from the unknowns; `None` where the scene has none."""
