"""Motion of chains and objects during a drop, from its edges and by the model."""

from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from rig.analysis.trajectory import Trajectory
from rig.arrays import Array
from rig.errors import DomainError
from rig.estimate.curves import model_fall
from rig.protocol.contact import of_run
from rig.protocol.protocol import Protocol, RodChain, Run, Side
from rig.report.falls import TimedDrop, passages

_POINTS = 120  # points of a curve: two in each column of a wide terminal


@dataclass(frozen=True, slots=True)
class ChainFall:
    """Fall of a chain or an object, measured and by the model.

    Attributes
    ----------
    role
        ``impact`` or ``free``.
    rods
        Falling chain or object.
    times, heights
        For each rod's passage of a beam: time since the release fired, s, and height of the bottom
        rod's middle above the contact point, m; in order of time.
    model
        Trajectory by the model; `None` outside its domain.
    delay_s
        Delay of the model's release after the fire stamp that fits the points, s.
    end_s
        Time at which all rods have struck or passed the last gate, by model and points, s.
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
        """Distance of the top rod's middle from that of the bottom rod, m."""
        return self.rods.chain.length

    def measured_height(self, time_s: float) -> float | None:
        """Return the measured height, m; constant after the last point, `None` before the first."""
        if not self.times.size or time_s < self.times[0]:
            return None
        return float(np.interp(time_s, self.times, self.heights))

    def model_height(self, time_s: float) -> float | None:
        """Return the height by the model, m, constant after the impact of the top rod."""
        if self.model is None:
            return None
        last = float(self.model.time[-1]) if self.model.hits is not None else np.inf
        return float(self.model.heights(np.clip([time_s - self.delay_s], 0.0, last))[0][0])

    def curve(self, end_s: float) -> tuple[Array, Array]:
        """Return times and heights of the model from the fire stamp on; empty without a model.

        A striking chain ends with the impact of its top rod.
        """
        if self.model is None:
            return np.empty(0), np.empty(0)
        if self.model.hits is not None:
            end_s = min(end_s, float(self.model.time[-1]) + self.delay_s)
        times = np.linspace(0.0, end_s, _POINTS)
        return times, self.model.heights(times - self.delay_s)[0]


def motions(
    protocol: Protocol, run: Run, recorded: TimedDrop | None = None
) -> tuple[ChainFall, ...]:
    """Return the falls of a run's chains, measured and by the model.

    Parameters
    ----------
    run
        The planned run.
    recorded
        The drop, calibrated ticks per second, and its result; `None` before the drop, for the
        model's curves alone.
    """
    protocol = of_run(protocol, run)
    sides: tuple[tuple[Side, str | None], ...] = (("impact", run.impact), ("free", run.free))
    falls = []
    for role, name in sides:
        if name is None or not protocol.gates.on(role):
            continue
        rods, model = protocol.chains[name], None
        with suppress(DomainError):
            model = model_fall(protocol, run, role)
            model = replace(model, height=model.height - rods.chain.length)
        times, heights, delay, end = np.empty(0), np.empty(0), 0.0, 0.0
        if recorded is not None:
            seen = passages(protocol, recorded, role)
            times, heights = seen.time, seen.height - rods.chain.length
        if model is not None and times.size:
            delay = float(np.median(times - model.times(heights)))
        if model is not None:
            lowest = min(gate.height for gate in protocol.gates.on(role)) - rods.chain.length
            last = model.times(np.array([lowest])) if model.hits is None else model.time
            end = delay + float(last[-1])
        end = max([end, *times.tolist()])
        falls.append(ChainFall(role, rods, times, heights, model, delay, end))
    return tuple(falls)
