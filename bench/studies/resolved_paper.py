"""The paper's scenes in the resolved world: ensembles to lay beside its figures and equations."""

from __future__ import annotations

from itertools import islice
from pathlib import Path
from statistics import fmean, stdev
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from bench.studies.falls import Asked, falls, simulation
from rig.measurands import MEASURANDS, SEPARATION, SPEED
from rig.model import paper

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    Columns = dict[str, list[float]]
    Ensemble = Sequence[Mapping[str, Any]]

DROPS = 16
"""Falls of one ensemble."""
EACH = 4
"""Falls of one rig and its chains, a divisor of `DROPS`: rods sit differently on other chains."""
INCLINES = tuple(5.0 * n for n in range(17))
_SCENE = """
protocol: 1
title: a figure of the paper
chains:
  A: {{{rods}, length: {paper.LENGTH:g} m, rod_length: 102 mm, tilt: {tilt:g} deg}}
  B: {{like: A}}
surface: {{restitution: {surface.restitution.value:g}, friction: {surface.friction.value:g}}}
drop: {paper.DROP:g} m
gravity: {paper.GRAVITY:g} m/s^2
gates: {{impact: [{{channel: 0, height: 25 mm}}], free: [{{channel: 8, height: 25 mm}}]}}
plan: {{incline: [{inclines}], repeats: {repeats}, settle: 0 s}}
"""
_HANGING = {
    "dynamics": "resolved", "quiet": "1", "rod_sd": "0.3 mm", "tilt_sd": "1 deg", "yaw_sd": "2 deg",
    "aside_sd": "0.5 mm", "swing_sd": "0.01 m/s",
}  # fmt: skip
"""Chains hang as they would, let go together and seen by a perfect rig."""
_SEPARATION = "separation_strike_m"
_MEASURED = {
    "incline_deg": "incline_deg", SEPARATION.name: _SEPARATION, SPEED.name: "speed_strike_m_s",
    "contact_height_m": "contact_height_m",
}  # fmt: skip
"""Columns of Fig. 3, and where they stand in the truth of a fall: Δz and V are those at the strike.
An ensemble is truths of falls that differ only in how their chains hang."""


def _ensembles(rods: str, tilt: float, inclines: Sequence[float]) -> list[Ensemble]:
    text = _SCENE.format(
        paper=paper,
        surface=paper.SURFACE,
        rods=rods,
        tilt=tilt,
        inclines=", ".join(f"{incline:g} deg" for incline in inclines),
        repeats=DROPS,
    )
    # Runs come in the plan's order: all of one incline, then all of the next.
    numbers = range(1, len(inclines) * DROPS + 1, EACH)
    runs = [[*range(first, first + EACH)] for first in numbers]
    with TemporaryDirectory() as folder:
        path = Path(folder) / "paper.yaml"
        path.write_text(text, encoding="utf-8")
        url = simulation(path, _HANGING)
        drops = falls([Asked(url, range(1, len(runs) + 1), runs)])
        return [[drop.truth for drop in islice(drops, DROPS)] for _ in inclines]


def figure_3() -> Columns:
    """Let the chains of Fig. 3 fall at each of `INCLINES`; return means and deviations."""
    uniform = f"rods: {paper.RODS}, diameter: 12.7 mm"
    ensembles = _ensembles(uniform, 12.0, INCLINES)
    columns: Columns = {}
    for name, key in _MEASURED.items():
        values = [[truth[key] for truth in ensemble] for ensemble in ensembles]
        columns[name] = [*map(fmean, values)]
        if name in MEASURANDS:
            columns[MEASURANDS[name].key("sd")] = [*map(stdev, values)]
    return columns | {"falls": [float(DROPS)] * len(ensembles)}


def figure_4() -> Columns:
    """Let the chain of Fig. 4 fall; return the top rods' heights against V².

    Of the fall nearest to the mean Δz.
    """
    groups = [f"{{count: 4, diameter: {1e3 * d:g} mm}}" for d in paper.GRADED_DIAMETERS[::4]]
    rods = f"rods: [{', '.join(groups)}], spacing: equal-gaps"
    (ensemble,) = _ensembles(rods, 21.0, (paper.MIDDLE_INCLINE,))
    middle = fmean(truth[_SEPARATION] for truth in ensemble)
    track = min(ensemble, key=lambda truth: abs(truth[_SEPARATION] - middle))["track"]
    times = np.asarray(track["times_s"])
    columns: Columns = {"time_s": times[1:-1].tolist()}
    for name, key in (("", "impact_top_m"), ("free_", "free_top_m")):
        heights = np.asarray(track[key])
        speeds = (heights[2:] - heights[:-2]) / (times[2:] - times[:-2])
        columns[f"{name}height_m"] = heights[1:-1].tolist()
        columns[f"{name}speed2"] = (speeds**2).tolist()
    return columns


FIGURES: Mapping[int, Callable[[], Columns]] = {3: figure_3, 4: figure_4}
