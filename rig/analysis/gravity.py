"""Gravity from the free chain, as a check of the clock: its rods fall past beams of known height.

This is no result. In g = 2·length/time² an error of the time scale counts twice, so a g that is not
the place's says that the clock, a beam's height or the protocol's gravity is not what it is said
to be. It takes the adjustment's matches of edges to rods, and none of its equations. What the air
takes is fitted beside it: a light chain would read several per cent less.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import fmean, stdev
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.analysis.adjust import least_squares
from rig.analysis.components import stated
from rig.analysis.drop_model import prior_air
from rig.analysis.equations import Linearization, plain_equations
from rig.analysis.evidence import STATED_WEIGHT
from rig.analysis.free_flight import leg_slopes
from rig.analysis.result import GOOD, Measured
from rig.analysis.unknowns import ANY_GRAVITY, ANYTHING
from rig.predictions import air_shares
from rig.threads import one_thread

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from rig.analysis.result import DropResult
    from rig.clock.calibration import TimeScale
    from rig.protocol.protocol import Protocol
    from rig.records import Drop
    from rig.units import Quantity

    Array = NDArray[np.float64]

_FEWEST = 8  # edges


@dataclass(frozen=True, slots=True)
class GravityCheck:
    """Gravity as the free chain falls and as the protocol says.

    Attributes
    ----------
    measured
        Mean over drops, m/s².
    stated
        The protocol's, m/s².
    drops
        How many.
    """

    measured: Measured
    stated: Quantity
    drops: int

    @property
    def normalized_error(self) -> float:
        """Of what is measured against what is stated."""
        stated = Measured(self.stated.value, self.stated.u)
        return self.measured.less(stated).normalized_error or 0.0

    @property
    def agrees(self) -> bool:
        """Whether they do."""
        return abs(self.normalized_error) <= 1.0

    def json(self) -> dict[str, Any]:
        """A member of ``calibration``."""
        return {
            "gravity_m_s2": self.measured.json(),
            "stated_m_s2": self.stated.value,
            "drops": self.drops,
            "normalized_error": self.normalized_error,
            "agrees": self.agrees,
        }


@one_thread
def check_gravity(
    protocol: Protocol, cases: Iterable[tuple[DropResult, Drop, TimeScale]]
) -> GravityCheck | None:
    """Compare the free chain's fall with the protocol's gravity.

    Parameters
    ----------
    protocol
        The scene.
    cases
        Analysed drops; those that are void or rejected do not count.

    Returns
    -------
    GravityCheck or None
        `None` where no free chain passes gates.
    """
    if protocol.gates is None or protocol.track is not None:  # friction is no fault of a clock
        return None
    found = [
        gravity
        for result, drop, scale in cases
        if result.verdict in GOOD
        and (gravity := free_gravity(protocol, result, drop, scale)) is not None
    ]
    if not found:
        return None
    # Beams, rods and clock are the same in every drop, so that no number of drops averages them.
    common = math.sqrt(fmean(one.u**2 for one in found))
    own = stdev(one.value for one in found) / math.sqrt(len(found)) if len(found) > 1 else 0.0
    u = math.hypot(common, own)
    degrees = (len(found) - 1) * (u / own) ** 4 if own else math.inf  # GUM G.4
    mean = Measured(fmean(one.value for one in found), u, degrees)
    return GravityCheck(mean, protocol.gravity, len(found))


@one_thread
def free_gravity(
    protocol: Protocol, result: DropResult, drop: Drop, scale: TimeScale
) -> Measured | None:
    """Fit a fall from rest to one drop's matched edges of the free side, with κ of the air.

    Generalised least squares: rods off their places, beams off their heights and rods as they
    look to a beam are common to several edges each, and stand in the covariance.
    """
    gates = {gate.channel: gate for gate in protocol.gates.on("free")} if protocol.gates else {}
    name = result.run.free
    pairs = [(drop.edges[at], rod) for at, rod in result.matches.items()]
    pairs = [(edge, rod) for edge, rod in pairs if edge.channel in gates]
    if name is None or protocol.gates is None or len(pairs) < _FEWEST:
        return None
    chain = protocol.chains[name]
    rods = np.array([rod for _, rod in pairs])
    channel = np.array([edge.channel for edge, _ in pairs])
    side = np.array([0.5 if edge.blocked else -0.5 for edge, _ in pairs])
    time = np.array([edge.tick for edge, _ in pairs]) / scale.hz
    time -= time.mean()  # else height and speed at time zero are nearly one unknown
    beam = np.array([gates[edge.channel].height for edge, _ in pairs])
    height = beam - np.array(chain.chain.heights)[rods] + side * np.array(chain.widths)[rods]
    design = np.stack([np.ones_like(time), time, -0.5 * time**2], axis=1)
    top, speed, fall = np.linalg.lstsq(design, height, rcond=None)[0]
    sizes = stated(protocol)
    sigma = np.hypot(sizes.floor, (speed - fall * time) * sizes.jitter)
    # The parabola's vertex is the release: where and when the speed was zero.
    point = np.array([top + speed**2 / (2.0 * fall), speed / fall, fall, 0.0])  # h, t, g and κ
    turn = np.where(rods % 2, -1.0, 1.0)  # neighbours are tilted the other way
    ripple = sizes.beam * math.tan(math.radians(chain.tilt_deg))
    # What edges have in common, one column each, in units of its standard uncertainty: with the
    # fit's own unknowns beside it, least squares need no covariance of all edges with all.
    beams = (channel[:, None] == np.array([*gates])).astype(float)
    common = np.column_stack(
        [
            chain.position_u * (rods[:, None] == np.arange(len(chain.widths))),
            protocol.gates.height_u * beams,
            ripple * turn[:, None] * beams,
            chain.width_u * side,
        ]
    )
    share = air_shares(protocol)[name][0]
    air, air_u = (share * one for one in prior_air(protocol))
    point[3] = air
    # Height, release and gravity are told by the edges alone.
    sd = np.concatenate([[ANYTHING, ANYTHING, ANY_GRAVITY, air_u], np.ones(common.shape[1])])

    def equations(x: Array, inflation: float) -> Linearization:
        at, release, g, kappa = point + x[:4]
        since = np.maximum(time - release, 0.0)
        fallen, end, _, by_gravity, by_kappa = leg_slopes(since, np.zeros_like(since), g, kappa)
        slopes = np.stack([-np.ones_like(time), -end, by_gravity, by_kappa], axis=1)
        off = height - at + fallen - common @ x[4:]
        weight = 1.0 / (sigma * inflation)
        return plain_equations(off * weight, np.column_stack([slopes, -common]) * weight[:, None])

    found = least_squares(equations, sd, np.zeros(sd.size))
    # How much edges scatter is seen where they are many; what is stated of it counts as one more.
    if found.scatter == 1.0:
        scatter = (STATED_WEIGHT + found.chi2) / (STATED_WEIGHT + found.degrees)
        sigma = sigma * math.sqrt(scatter)
        found = least_squares(equations, sd, found.x)
    value = float(point[2] + found.x[2])
    fitted = math.sqrt(found.covariance[2, 2]) * sd[2]
    return Measured(value, math.hypot(fitted, 2.0 * value * scale.u))
