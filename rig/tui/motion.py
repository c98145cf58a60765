"""Where what fell was during a drop, from its edges, beside where the model has it."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rig.errors import DomainError
from rig.estimate.curves import model_fall
from rig.protocol.contact import at_contact
from rig.report.falls import passages

if TYPE_CHECKING:
    from fractions import Fraction

    from rig.analysis.result import DropResult
    from rig.analysis.trajectory import Trajectory
    from rig.arrays import Array
    from rig.protocol.protocol import Protocol, RodChain, Run, Side
    from rig.records import Drop

_POINTS = 120  # of a curve: two a column of a wide terminal


@dataclass(frozen=True, slots=True)
class ChainFall:
    """One chain's way down, or an object's.

    Attributes
    ----------
    role
        ``impact`` or ``free``.
    rods
        What falls.
    times, heights
        Of each rod's passage of a beam: seconds since the release fired, and the height of the
        bottom rod's middle above the contact point that follows, m; in order of time.
    model
        `None` outside the model's domain.
    delay_s
        By how much the model's release is later than the fire stamp, so that it meets the points.
    end_s
        When all of it has struck or passed the last gate, by the model and by the points.
    """

    role: Side
    rods: RodChain
    times: Array
    heights: Array
    model: Trajectory | None
    delay_s: float
    end_s: float

    @property
    def length(self) -> float:
        """From the bottom rod's middle to the top one's, m."""
        return self.rods.chain.length

    def measured(self, time_s: float) -> float | None:
        """Height as the gates saw it, at their last word after that; `None` before their first."""
        if not self.times.size or time_s < self.times[0]:
            return None
        return float(np.interp(time_s, self.times, self.heights))

    def expected(self, time_s: float) -> float | None:
        """Height by the model, which ends with the impact of the top rod."""
        if self.model is None:
            return None
        last = float(self.model.time[-1]) if self.model.hits is not None else np.inf
        return float(self.model.heights(np.clip([time_s - self.delay_s], 0.0, last))[0][0])

    def curve(self, end_s: float) -> tuple[Array, Array]:
        """Model's heights from the fire stamp to a time; empty without a model.

        What strikes the surface ends there, with the impact of its top rod.
        """
        if self.model is None:
            return np.empty(0), np.empty(0)
        if self.model.hits is not None:
            end_s = min(end_s, float(self.model.time[-1]) + self.delay_s)
        times = np.linspace(0.0, end_s, _POINTS)
        return times, self.model.heights(times - self.delay_s)[0]


def motions(
    protocol: Protocol,
    run: Run,
    recorded: tuple[Drop, float | Fraction, DropResult] | None = None,
) -> tuple[ChainFall, ...]:
    """Turn a drop's edges into heights.

    Parameters
    ----------
    run
        What hung where.
    recorded
        The drop, calibrated ticks per second, and which edge is of which rod; `None` before it
        fell, when there are only the model's curves.
    """
    protocol = at_contact(protocol, run.incline_deg, run.impact)
    gates = protocol.gates
    sides: tuple[tuple[Side, str | None], ...] = (("impact", run.impact), ("free", run.free))
    falls = []
    for role, name in sides:
        if name is None or gates is None or not gates.on(role):
            continue
        rods, model = protocol.chains[name], None
        with suppress(DomainError):
            model = model_fall(protocol, run, role)
            model = replace(model, height=model.height - rods.chain.length)
        times, heights, delay, end = np.empty(0), np.empty(0), 0.0, 0.0
        if recorded is not None:
            seen = passages(protocol, *recorded, role)
            times, heights = seen.time, seen.height - rods.chain.length
        if model is not None and times.size:
            delay = float(np.median(times - model.times(heights)))
        if model is not None:
            lowest = min(gate.height for gate in gates.on(role)) - rods.chain.length
            struck = float(model.time[-1]) if model.hits is not None else 0.0
            end = delay + (struck or float(model.times(np.array([lowest]))[0]))
        falls.append(
            ChainFall(role, rods, times, heights, model, delay, max([end, *times.tolist()]))
        )
    return tuple(falls)
