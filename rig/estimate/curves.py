"""Δz(t) and V²(z) of a measured drop, with bands (the paper's Fig. 4)."""

from typing import Any, NamedTuple

import numpy as np

from rig.analysis.budgets import Budgets
from rig.analysis.distributions import coverage_factor
from rig.analysis.dual import Dual
from rig.analysis.fit import Fit
from rig.analysis.joint_fit import JointFit, by_itself
from rig.analysis.joint_step import JointDrop
from rig.analysis.quantities import AdjustedDrop
from rig.analysis.trajectory import Trajectory, free_trajectory, struck_trajectory
from rig.arrays import Array
from rig.measurands import SEPARATION
from rig.model.fall import kicks
from rig.model.impact import impact_on
from rig.plain_data import attributes
from rig.predictions import air_of
from rig.protocol.contact import higher_contacts, of_run
from rig.protocol.protocol import Protocol, Run, Side

POINTS = 120


class Curve(NamedTuple):
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
        ends = {"": self.measured, "_U95": self.u95, "_model": self.model}
        return {name + end: values.tolist() for end, values in ends.items()}


class DropCurves(NamedTuple):
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
        record = attributes(self, "*run", "height_m") | self.squared_speed.json("speed2_m2_s2")
        if self.separation is not None:
            record |= attributes(self, "time_s") | self.separation.json(SEPARATION.name)
        return record


def drop_curves(
    protocol: Protocol, run: Run, drop: Fit | JointDrop, joint: JointFit | None
) -> DropCurves:
    """Follow one drop from release to the top rod's hit, with bands."""
    if isinstance(drop, Fit):
        joint = by_itself(drop)
        (drop,) = joint.drops
    assert joint is not None
    adjusted, budgets = AdjustedDrop(drop.model, drop.x), Budgets(joint)

    def with_band(measured: Dual, model: Array) -> Curve:
        _, own, shared = budgets.roots(drop, measured.slopes)
        variance = np.sum(own**2, axis=1) + np.sum(shared**2, axis=1)
        return Curve(measured.value, coverage_factor(np.inf) * np.sqrt(variance), model)

    begin = drop.model.trajectory("impact", drop.x).height[:1]
    hanging = adjusted.top("impact", Dual(begin, np.zeros((1, drop.x.size)))).value.item()
    heights = np.linspace(hanging - 1e-6, 0.0, POINTS)
    lasted = adjusted.arrival.when - adjusted.release("impact")
    times = np.linspace(0.0, float(lasted.value), POINTS)
    struck, separation = model_fall(protocol, run, "impact"), None
    if "free" in drop.model.records:
        free, moments = model_fall(protocol, run, "free"), np.minimum(times, struck.time[-1])
        by_model = free.heights(moments)[0] - struck.heights(moments)[0]
        free_top, struck_top = (
            adjusted.top(role, adjusted.levels(role, adjusted.release(role) + times))
            for role in ("free", "impact")
        )
        separation = with_band(free_top - struck_top, by_model)
    squares = with_band(_squares(adjusted, heights), struck.passages(heights)[1] ** 2)
    return DropCurves(run, heights, squares, times, separation)


def _squares(drop: AdjustedDrop, heights: Array) -> Dual:
    """V² of the impact chain when its top rod is at some heights."""
    levels = Dual(heights, np.zeros((heights.size, drop.x.size)))
    levels -= drop.model.records["impact"].chain.chain.length
    for _ in range(2):  # what the top rod is off its chain hardly depends on the level
        levels = levels + heights - drop.top("impact", levels)
    speed = drop.squares("impact", levels).root()
    speed += drop.gain("impact", levels.value) * speed
    if (catching_up := drop.model.discrepancy.late_way) > 0.0:  # below the lowest beam
        speed += drop.late * np.clip(1.0 - heights / catching_up, 0.0, 1.0)
    return speed * speed


def model_fall(protocol: Protocol, run: Run, role: Side) -> Trajectory:
    """Return the model's fall of a chain's top rod in the stated air, from its release at time 0.

    Its heights are above the contact point. Without a free chain, the one that strikes falls in its
    place.

    Raises
    ------
    DomainError
        Where Eq. 13 has no finite solution at the run's incline.
    """
    protocol = of_run(protocol, run)
    name = run.impact if role == "impact" else run.free or run.impact
    assert name is not None
    rods, gravity = protocol.chains[name], protocol.gravity.value
    chain, kappas = rods.chain, air_of(protocol, name) or [0.0] * rods.chain.rods
    start = protocol.drop.value + chain.length
    if role == "free" or protocol.surface is None:
        return free_trajectory(0.0, start, gravity, kappas[0])
    impact = impact_on(protocol.surface, chain, run.incline_deg)
    gains = kicks(chain, [impact.alpha] * chain.rods, impact.gamma)
    # Of the top rod, as each touches: one that touches higher does so earlier.
    touching = chain.length - np.array(chain.heights)
    touching += higher_contacts(protocol, run.incline_deg, rods)
    path = np.array(gains), np.ones(chain.rods), -touching
    return struck_trajectory(0.0, start, gravity, *path, 1.0, np.array([*kappas, kappas[-1]]))
