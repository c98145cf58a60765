"""The model's curves against inclination, for pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rig.analysis.distributions import coverage_factor
from rig.predictions import beside, predict_incline

if TYPE_CHECKING:
    from rig.protocol.protocol import Protocol

_BEYOND = 5.0  # degrees that the curves go on beyond the outermost inclines
_STEEPEST = 89.0


def model_curves(protocol: Protocol) -> dict[str, Any]:
    """Predict Δz and V, with their bands, degree by degree; empty where nothing is struck.

    Returns
    -------
    dict
        As `rig.report.figures.incline_figure` takes it.
    """
    surface = protocol.surface
    if surface is None:
        return {}
    inclines = protocol.plan.inclines
    low = max(0.0, min(inclines) - _BEYOND)
    high = min(_STEEPEST, max(inclines) + _BEYOND)
    points = set(np.arange(low, high + 0.5, 1.0).tolist())
    if surface.pile is not None and low < surface.pile.below_deg <= high:
        edge = surface.pile.below_deg
        points |= {edge, float(np.nextafter(edge, 0.0))}
    every = [
        (struck, predict_incline(protocol, incline, struck, beside(protocol, struck)))
        for struck in protocol.strikers
        for incline in sorted(points)
    ]
    found = [one for _, one in every if one.separation is not None]
    segments = [
        ("pile" if "pile" in one.model else "surface")
        + (f", chain {struck}" if protocol.unlike_chains else "")
        for struck, one in every
        if one.separation is not None
    ]
    factor = coverage_factor(float("inf"))
    curves: dict[str, Any] = {
        "incline_deg": [one.incline_deg for one in found],
        "segments": segments,
        "speed_m_s": [one.speed for one in found],
        "speed_U95_m_s": [factor * (one.speed_u or 0.0) for one in found],
        "free_fall_speed_m_s": every[0][1].free_fall_speed,
    }
    if protocol.two_chains:
        curves["separation_m"] = [one.separation for one in found]
        curves["separation_U95_m"] = [factor * (one.separation_u or 0.0) for one in found]
    return curves
