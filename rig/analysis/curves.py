"""The model's curves against inclination, for pictures."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.analysis.distributions import coverage_factor
from rig.measurands import SEPARATION, SPEED
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
    found = [each for each in every if each[1].separation is not None]
    curves: dict[str, Any] = {
        "incline_deg": [each.incline_deg for _, each in found],
        "segments": [
            ("pile" if "pile" in each.model else "surface")
            + (f", chain {struck}" if protocol.unlike_chains else "")
            for struck, each in found
        ],
        "free_fall_speed_m_s": every[0][1].free_fall_speed,
    }
    for row in (SPEED, SEPARATION) if protocol.two_chains else (SPEED,):
        sizes = [getattr(each, f"{row.stem}_u") or 0.0 for _, each in found]
        curves[row.name] = [getattr(each, row.stem) for _, each in found]
        curves[row.key("U95")] = [coverage_factor(math.inf) * u for u in sizes]
    return curves
