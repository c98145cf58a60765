"""The measurands, as functions of the adjusted unknowns, with their uncertainty."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.adjust import uncertainty
from rig.analysis.result import Measured

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rig.analysis.adjust import Estimate
    from rig.analysis.drop_model import DropModel

    Array = NDArray[np.float64]


def quantities(model: DropModel, estimate: Estimate) -> dict[str, Measured]:
    """Return everything the scene lets one measure, by its JSON name."""
    return {
        name: _measured(model, estimate, value, gradient)
        for name, (value, gradient) in measurands(model, estimate.x).items()
    }


def measurands(model: DropModel, x: Array) -> dict[str, tuple[float, Array]]:
    """Return the value of each measurand and its derivatives by all unknowns."""
    if "impact" not in model.sides:
        return {"gravity_m_s2": _gravity(model, x)}
    found = _separation(model, x) if "free" in model.sides else {}
    return found | _impact(model, x)


def _measured(model: DropModel, estimate: Estimate, value: float, gradient: Array) -> Measured:
    u, budget = uncertainty(estimate, gradient, model.unknowns.groups)
    return Measured(value, u, max(1.0, estimate.degrees), budget)


def _gravity(model: DropModel, x: Array) -> tuple[float, Array]:
    gradient = np.zeros(x.size)
    gradient[model.unknowns["gravity"]] = 1.0
    return model.protocol.gravity.value + float(x[model.unknowns["gravity"]][0]), gradient


def _impact(model: DropModel, x: Array) -> dict[str, tuple[float, Array]]:
    """V just before the top rod strikes, and how long that took."""
    path = model.trajectory("impact", x)
    duration = model.spread("impact", path.d_time[-1])
    duration[model.unknowns["impact release"]] = 0.0  # it moves both ends
    return {
        "speed_m_s": (path.arrival, model.spread("impact", path.d_arrival)),
        "fall_time_s": (float(path.time[-1] - path.time[0]), duration),
    }


def _separation(model: DropModel, x: Array) -> dict[str, tuple[float, Array]]:
    """Δz raw and at simultaneous release, and the release skew."""
    at = model.unknowns
    struck, free = model.trajectory("impact", x), model.trajectory("free", x)
    skew = float(free.time[0] - struck.time[0])
    d_skew = np.zeros(x.size)
    d_skew[at["free release"]], d_skew[at["impact release"]] = 1.0, -1.0
    top = model.sides["free"].chain.chain.length + float(x[at["free rods"]][-1])
    d_hit = model.spread("impact", struck.d_time[-1])

    def separation(when: float, d_when: Array) -> tuple[float, Array]:
        height, speed = free.heights(np.array([when]))
        gradient = model.spread("free", free.derivatives(np.array([when])))[0]
        gradient[at["free rods"].stop - 1] += 1.0
        return float(height[0]) + top, gradient - float(speed[0]) * d_when

    hit = float(struck.time[-1])
    return {
        "separation_m": separation(hit + skew, d_hit + d_skew),
        "separation_raw_m": separation(hit, d_hit),
        "release_skew_s": (skew, d_skew),
    }
