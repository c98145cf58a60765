"""Δz(t) and V²(z) of a measured drop, with bands (the paper's Fig. 4)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.analysis.distributions import coverage_factor
from rig.analysis.fit import Fit
from rig.analysis.free_flight import squared_after
from rig.analysis.quantities import Adjusted
from rig.analysis.swing import drawn, lever
from rig.measurands import SEPARATION
from rig.model.fall import hits, kicks
from rig.model.motion import Motion
from rig.model.rods import rod_impacts
from rig.protocol.contact import as_struck, at_contact

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from rig.analysis.drop_model import DropModel
    from rig.analysis.joint_fit import JointDrop, JointFit
    from rig.model.chain import Chain
    from rig.protocol.protocol import Protocol, Run

    Array = NDArray[np.float64]

POINTS = 120
_STEP = 1e-3  # of an unknown's prior uncertainty


@dataclass(frozen=True, slots=True)
class Curve:
    """A quantity along a fall, each array of shape ``(POINTS,)``.

    Attributes
    ----------
    measured, u95
        Values, and half-widths of their 95 % bands, point by point.
    model
        By the model with the protocol's coefficients.
    """

    measured: Array
    u95: Array
    model: Array

    def json(self, name: str) -> dict[str, list[float]]:
        """``{name, name_U95, name_model}``."""
        return {
            name: self.measured.tolist(),
            f"{name}_U95": self.u95.tolist(),
            f"{name}_model": self.model.tolist(),
        }


@dataclass(frozen=True, slots=True)
class DropCurves:
    """One drop from release to the top rod's hit.

    Attributes
    ----------
    height_m
        Of the top rod above the contact point, shape ``(POINTS,)``.
    squared_speed
        V² of the impact chain at these heights, m²/s².
    time_s
        Since the release, shape ``(POINTS,)``.
    separation
        Δz at these times at simultaneous release, m; `None` without a free chain.
    """

    run: Run
    height_m: Array
    squared_speed: Curve
    time_s: Array
    separation: Curve | None

    def json(self) -> dict[str, Any]:
        """One of ``curves``."""
        said: dict[str, Any] = {
            "run": self.run.number,
            "incline_deg": self.run.incline_deg,
            "impact_chain": self.run.impact,
            "height_m": self.height_m.tolist(),
            **self.squared_speed.json("speed2_m2_s2"),
        }
        if self.separation is not None:
            said |= {"time_s": self.time_s.tolist(), **self.separation.json(SEPARATION.name)}
        return said


def drop_curves(
    protocol: Protocol, run: Run, drop: Fit | JointDrop, joint: JointFit | None
) -> DropCurves:
    """Follow one drop from release to the top rod's hit, with bands."""
    model, x = drop.model, drop.x
    begin = model.trajectory("impact", x).time[0]
    heights = np.linspace(_top(model, x) - 1e-6, 0.0, POINTS)
    times = np.linspace(0.0, float(Adjusted(model, x).hit[0] - begin), POINTS)
    separation = None
    if "free" in model.records:
        separation = Curve(
            *_with_band(lambda at: _separations(model, at, times), drop, joint),
            _separations_by_model(protocol, run, times),
        )
    squares = Curve(
        *_with_band(lambda at: _squares(model, at, heights), drop, joint),
        _squares_by_model(protocol, run, heights, model.records["impact"].chain.chain.length),
    )
    return DropCurves(run, heights, squares, times, separation)


def _top(model: DropModel, x: Array) -> float:
    """Height of the top rod before the release."""
    start = model.trajectory("impact", x).height[0]
    return float(start + _places(model, x, "impact")[-1])


def _places(model: DropModel, x: Array, role: str) -> Array:
    chain = model.records[role].chain.chain
    found: Array = np.array(chain.heights) + x[model.unknowns[f"{role} rods"]]
    return found


def _squares(model: DropModel, x: Array, heights: Array) -> Array:
    """V² of the impact chain when its top rod is at a height."""
    path = model.trajectory("impact", x)
    level = heights - _places(model, x, "impact")[-1]
    level -= _alone(model, x, level) - _turned(model, x, "impact", level)
    ahead, faster = _stretched(model, x, level)
    way = model.discrepancy.late_way
    if way > 0.0:  # it comes by and by, below the lowest beam
        late = model.discrepancy.late_pull * float(x[model.unknowns["late"]][0])
        faster = faster + late * np.clip(1.0 - heights / way, 0.0, 1.0)
    level += ahead
    leg = np.maximum(np.searchsorted(-path.height[:-1], -level, side="left") - 1, 0)
    distance = path.height[leg] - level
    squares = squared_after(distance, path.speed[leg], path.gravity, path.kappas(leg))
    return squares + (2.0 * np.sqrt(np.maximum(squares, 0.0)) + faster) * faster


def _separations(model: DropModel, x: Array, times: Array) -> Array:
    """How far the free chain's top rod is above the other's, each so long after its release."""
    struck, free = model.trajectory("impact", x), model.trajectory("free", x)
    level = struck.heights(struck.time[0] + times)[0]
    apart = _places(model, x, "free")[-1] - _places(model, x, "impact")[-1]
    apart = apart - _alone(model, x, level) + _stretched(model, x, level)[0]
    beside = free.heights(free.time[0] + times)[0]
    apart = apart + _turned(model, x, "impact", level) - _turned(model, x, "free", beside)
    found: Array = beside - level + apart
    return found


def _stretched(model: DropModel, x: Array, level: Array) -> tuple[Array, Array]:
    """How far ahead strings have pulled the top rod, and how much faster it is for that."""
    modes, sizes = model.discrepancy.top(level), model.stretch(x)
    return modes.way @ sizes, modes.rate @ sizes


def _turned(model: DropModel, x: Array, role: str, level: Array) -> Array:
    """How much lower the top rod of a chain that turns is than on a straight one."""
    swing = f"{role} swing"
    if swing not in model.unknowns:
        return np.zeros_like(level)
    chain = model.records[role].chain.chain
    found: Array = x[model.unknowns[swing]] * drawn(lever(chain)[-1:], model.protocol, level)
    return found


def _alone(model: DropModel, x: Array, level: Array) -> Array:
    """How far the top rod is off its chain once it is all that falls, by the reference's height."""
    rods = model.records["impact"].chain.chain.rods
    last = level < model.trajectory("impact", x).height[rods - 1]
    found: Array = np.where(last, x[model.unknowns["top"]], 0.0)
    return found


def _with_band(
    curve: Callable[[Array], Array], drop: Fit | JointDrop, joint: JointFit | None
) -> tuple[Array, Array]:
    """Values, and 1.96 standard uncertainties from the covariance of the adjustment."""
    x, sd = drop.x, drop.model.unknowns.sd
    slopes = np.stack(
        [
            (curve(x + step) - curve(x - step)) / (2.0 * _STEP)
            for step in _STEP * np.diag(np.where(sd < 1.0, sd, 1e-3))
        ],
        axis=1,
    )
    # A prior of "anything" is too far to step: a thousandth was stepped, and is scaled back here.
    slopes[:, sd >= 1.0] *= 1e3 * sd[sd >= 1.0]
    if isinstance(drop, Fit) or joint is None:
        assert isinstance(drop, Fit)
        variance = np.sum((slopes @ drop.estimate.inverse) ** 2, axis=1)
    else:
        own, common = slopes[:, drop.own], slopes[:, drop.common]
        left = common - own @ drop.gain
        variance = np.sum((own @ drop.inverse) ** 2, axis=1)
        variance += np.sum((left @ joint.inverse[drop.here]) ** 2, axis=1)
    band = coverage_factor(np.inf) * np.sqrt(variance)
    return curve(x), band


def _by_model(protocol: Protocol, run: Run) -> tuple[Chain, float, list[float]]:
    """The chain that strikes, its drop, and what the model says it gains from each rod."""
    assert run.impact is not None
    protocol = at_contact(protocol, run.incline_deg, run.impact)
    assert protocol.surface is not None
    chain, drop = as_struck(protocol, run.incline_deg, run.impact)
    impacts = rod_impacts(protocol.surface, chain, run.incline_deg)
    gains = kicks(chain, [one.alpha for one in impacts], [one.gamma for one in impacts])
    return chain, drop.value, gains


def _squares_by_model(protocol: Protocol, run: Run, heights: Array, top: float) -> Array:
    """V² by the model; `top` is the top rod's height above the bottom one."""
    chain, drop, gains = _by_model(protocol, run)
    gravity = protocol.gravity.value
    struck = hits(chain, gains, drop, gravity)
    before = np.array([-drop, *chain.heights[:-1]])
    after = np.array([0.0, *(hit.speed_after for hit in struck[:-1])])
    fallen = top - heights
    leg = np.maximum(np.searchsorted(before, fallen, side="left") - 1, 0)
    found: Array = np.maximum(after[leg] ** 2 + 2.0 * gravity * (fallen - before[leg]), 0.0)
    return found


def _separations_by_model(protocol: Protocol, run: Run, times: Array) -> Array:
    chain, drop, gains = _by_model(protocol, run)
    motion = Motion(chain, gains, drop, protocol.gravity.value)
    return np.array([motion.at(min(time, motion.end_s)).separation_m for time in times.tolist()])
