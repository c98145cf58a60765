"""The paper's scenes in the resolved world: ensembles to lay beside its figures and equations."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from statistics import fmean, stdev
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.bench.falls import Asked, falls, with_setting
from rig.measurands import SEPARATION, SPEED
from rig.model import paper

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rig.bench.falls import SimulatedDrop

    Columns = dict[str, list[float]]

DROPS = 16
"""Falls of one ensemble."""
EACH = 4
"""Falls of one rig and its chains: rods sit differently from chain to chain, as they do in labs."""
FRAMES_EARLY = 2
"""Between the last frame that Fig. 4 tracks and the impact."""
INCLINES = tuple(5.0 * n for n in range(17))
_SCENE = """
protocol: 1
title: {title}
chains:
  A: {{{rods}, length: {length:g} mm, rod_length: 102 mm, tilt: {tilt:g} deg}}
  B: {{like: A}}
surface: {{restitution: {beta:g}, friction: {mu:g}}}
drop: {drop:g} mm
gravity: {gravity:g} m/s^2
gates: {{impact: [{{channel: 0, height: 25 mm}}], free: [{{channel: 8, height: 25 mm}}]}}
plan: {{incline: [{inclines}], repeats: {repeats}, settle: 0 s}}
"""
_HANGING = {
    "quiet": "1", "rod_sd": "0.3 mm", "tilt_sd": "1 deg", "yaw_sd": "2 deg",
    "aside_sd": "0.5 mm", "swing_sd": "0.01 m/s",
}  # fmt: skip
"""Chains hang as they would, let go together and seen by a perfect rig."""

_SOFT, _AIR = {"restitution": "0.3"}, {"drag": "0.03"}
AS_MEASURED: dict[str, dict[str, str]] = {"β 0.5, no air": {}}
VARIANTS = AS_MEASURED | {"β 0.3": _SOFT, "air": _AIR, "β 0.3 and air": _SOFT | _AIR}
"""What may make the Δz of Fig. 4 smaller than the equations say, alone and together."""


@dataclass(frozen=True, slots=True)
class Ensemble:
    """Falls that differ only in how their chains hang.

    Attributes
    ----------
    name, incline_deg
        Of the scene.
    separations, speeds, heights
        Δz and V at the strike, and the height of the contact, of each fall; m and m/s.
    early
        Δz `FRAMES_EARLY` frames of the paper's camera before the strike, m.
    tracks
        Times and heights of both top rods.
    """

    name: str
    incline_deg: float
    separations: tuple[float, ...]
    speeds: tuple[float, ...]
    heights: tuple[float, ...]
    early: tuple[float, ...]
    tracks: tuple[Mapping[str, Sequence[float]], ...]

    def json(self) -> dict[str, Any]:
        """Means, standard deviations and how many falls."""
        found: dict[str, Any] = {
            "name": self.name,
            "incline_deg": self.incline_deg,
            "n": len(self.separations),
        }
        for name in ("separations", "speeds", "heights", "early"):
            values = getattr(self, name)
            found[name] = fmean(values)
            found[f"{name}_sd"] = stdev(values)
        return found


def uniform(drops: int = DROPS, settings: Mapping[str, str] | None = None) -> list[Ensemble]:
    """Let the chains of Fig. 3 fall, at each of `INCLINES`.

    Parameters
    ----------
    drops
        Falls at each incline.
    settings
        Dials of the resolved world, where not its defaults.
    """
    rods = f"rods: {paper.RODS}, diameter: 12.7 mm"
    with TemporaryDirectory() as folder:
        asked = _asked(Path(folder), "fig3", rods, 12.0, INCLINES, drops, settings or {})
        made = falls([asked])
        # Runs come in the plan's order: all of one incline, then all of the next.
        return [_ensemble("uniform", list(islice(made, drops))) for _ in INCLINES]


def graded(
    drops: int = DROPS, variants: Mapping[str, Mapping[str, str]] | None = None
) -> list[Ensemble]:
    """Let the chain of Fig. 4 fall.

    Parameters
    ----------
    drops
        Falls of each ensemble.
    variants
        Dials by name; by default all of `VARIANTS`.
    """
    variants = VARIANTS if variants is None else variants
    groups = [f"{{count: 4, diameter: {1e3 * d:g} mm}}" for d in paper.GRADED_DIAMETERS[::4]]
    rods = f"rods: [{', '.join(groups)}], spacing: equal-gaps"
    with TemporaryDirectory() as folder:
        asked = [
            _asked(Path(folder), "fig4", rods, 21.0, (paper.MIDDLE_INCLINE,), drops, settings)
            for settings in variants.values()
        ]
        made = falls(asked)
        return [_ensemble(name, list(islice(made, drops))) for name in variants]


def _asked(
    folder: Path,
    name: str,
    rods: str,
    tilt: float,
    inclines: Sequence[float],
    drops: int,
    settings: Mapping[str, str],
) -> Asked:
    path = folder / f"{name}.yaml"
    text = _SCENE.format(
        title=name,
        rods=rods,
        tilt=tilt,
        length=1e3 * paper.LENGTH,
        beta=paper.SURFACE.restitution.value,
        mu=paper.SURFACE.friction.value,
        drop=1e3 * paper.DROP,
        gravity=paper.GRAVITY,
        inclines=", ".join(f"{one:g} deg" for one in inclines),
        repeats=drops,
    )
    path.write_text(text, encoding="utf-8")
    url = with_setting("sim://?dynamics=resolved", "protocol", str(path))
    for dial, value in (_HANGING | dict(settings)).items():
        url = with_setting(url, dial, value)
    runs = [
        [*range(first + 1, min(first + EACH, begin + drops) + 1)]
        for begin in range(0, len(inclines) * drops, drops)
        for first in range(begin, begin + drops, EACH)
    ]
    return Asked(url, range(1, len(runs) + 1), runs)


def _ensemble(name: str, made: Sequence[SimulatedDrop]) -> Ensemble:
    truths = [fall.truth for fall in made]
    tracks = tuple(truth["track"] for truth in truths)
    return Ensemble(
        name,
        truths[0]["incline_deg"],
        tuple(truth["separation_strike_m"] for truth in truths),
        tuple(truth["speed_strike_m_s"] for truth in truths),
        tuple(truth["contact_height_m"] for truth in truths),
        tuple(_early(track) for track in tracks),
        tracks,
    )


def _early(track: Mapping[str, Sequence[float]]) -> float:
    """Separation as it was some frames before the strike, m."""
    apart = np.subtract(track["free_top_m"], track["impact_top_m"])
    when = track["times_s"][-1] - FRAMES_EARLY * paper.FRAME_S
    return float(np.interp(when, track["times_s"], apart))


def figure_3(found: Sequence[Ensemble]) -> Columns:
    """Means and standard deviations against inclination, as columns for the figure."""
    rows = [one.json() for one in found]
    names = {
        "incline_deg": "incline_deg", SEPARATION.name: "separations",
        SEPARATION.key("sd"): "separations_sd", SPEED.name: "speeds", SPEED.key("sd"): "speeds_sd",
        "contact_height_m": "heights", "falls": "n",
    }  # fmt: skip
    return {name: [float(row[key]) for row in rows] for name, key in names.items()}


def figure_4(found: Ensemble) -> Columns:
    """Height of the top rod against V², striking and free, of the fall nearest to the mean Δz."""
    middle = fmean(found.separations)
    nearest = min(range(len(found.tracks)), key=lambda n: abs(found.separations[n] - middle))
    track = found.tracks[nearest]
    times = np.asarray(track["times_s"])
    columns: Columns = {"time_s": times[1:-1].tolist()}
    for name, key in (("", "impact_top_m"), ("free_", "free_top_m")):
        heights = np.asarray(track[key])
        speeds = (heights[2:] - heights[:-2]) / (times[2:] - times[:-2])
        columns[f"{name}height_m"] = heights[1:-1].tolist()
        columns[f"{name}speed2"] = (speeds**2).tolist()
    return columns
