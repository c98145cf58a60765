"""Predictions against inclination, for figures."""

import math
from functools import lru_cache
from typing import Any

from rig.analysis.distributions import coverage_factor
from rig.measurands import SEPARATION, SPEED
from rig.predictions import predict_incline
from rig.protocol.protocol import Protocol

_BEYOND = 5.0  # degrees by which curves extend beyond the outermost inclines
_STEEPEST = 89.0


@lru_cache(maxsize=4)
def model_curves(protocol: Protocol) -> dict[str, Any]:
    """Predict Δz and V with their bands for every degree; empty without a surface.

    Returns
    -------
    dict
        Argument `curves` of `rig.report.figures.result_figure`.
    """
    surface = protocol.surface
    if surface is None:
        return {}
    inclines = protocol.plan.inclines
    low, high = max(0.0, min(inclines) - _BEYOND), min(_STEEPEST, max(inclines) + _BEYOND)
    points = {low + degrees for degrees in range(math.ceil(high + 0.5 - low))}
    if surface.pile is not None and low < surface.pile.below_deg <= high:
        edge = surface.pile.below_deg
        points |= {edge, math.nextafter(edge, 0.0)}
    predictions = [
        (struck, predict_incline(protocol, incline, struck))
        for struck in protocol.strikers
        for incline in sorted(points)
    ]
    in_domain = [pair for pair in predictions if pair[1].separation_m is not None]
    curves: dict[str, Any] = {
        "incline_deg": [pair.incline_deg for _, pair in in_domain],
        "segments": [
            ("pile" if "pile" in pair.model else "surface")
            + (f", chain {struck}" if protocol.unlike_chains else "")
            for struck, pair in in_domain
        ],
        "free_fall_speed_m_s": predictions[0][1].free_fall_speed_m_s,
    }
    for row in (SPEED, SEPARATION) if protocol.two_chains else (SPEED,):
        sizes = [getattr(pair, row.key("u")) or 0.0 for _, pair in in_domain]
        curves[row.name] = [getattr(pair, row.name) for _, pair in in_domain]
        curves[row.key("U95")] = [coverage_factor(math.inf) * u for u in sizes]
    return curves
