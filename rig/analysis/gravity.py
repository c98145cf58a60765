"""Gravity from the free chain, as a check of the clock: its rods fall past beams of known height.

This is no result. In g = 2·length/time² an error of the time scale counts twice, so a g that is not
the place's says that the clock, a beam's height or the protocol's gravity is not what it is said
to be. It uses none of the adjustment's machinery but its matches of edges to rods. What the air
takes is fitted beside it: a light chain would read several per cent less.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import fmean, stdev
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.analysis.distributions import coverage_factor
from rig.analysis.free_flight import leg_slopes
from rig.analysis.result import GOOD, Measured
from rig.analysis.unknowns import DRAG_U
from rig.threads import one_thread

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rig.analysis.result import DropResult
    from rig.clock.calibration import TimeScale
    from rig.protocol.protocol import Protocol
    from rig.records import Drop
    from rig.units import Quantity

_EDGE_M = 0.1e-3  # where on a rod's surface a beam is cut
_EDGE_S = 5e-6  # comparator and stamp
_BEAM_M = 1e-3  # how far off a rod's middle a beam may run: tan(tilt) makes a height of it
_FEWEST = 8  # edges
_STEPS = 6
_FIXED = 1e18  # inverse square of a prior uncertainty that leaves nothing free


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
        """E_n = (measured − stated)/√(U² + U_s²); within ±1 they agree (ISO 13528)."""
        width = math.hypot(self.measured.expanded, coverage_factor(math.inf) * self.stated.u)
        return (self.measured.value - self.stated.value) / width

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
        `None` where no free chain passes gates, and in air that slows it.
    """
    if protocol.gates is None or protocol.drag is not None:
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
    mean = Measured(fmean(one.value for one in found), math.hypot(common, own))
    return GravityCheck(mean, protocol.gravity, len(found))


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
    sigma = np.hypot(_EDGE_M, (speed - fall * time) * _EDGE_S)
    # The parabola's vertex is the release: where and when the speed was zero.
    point = np.array([top + speed**2 / (2.0 * fall), speed / fall, fall, 0.0])  # h, t, g and κ
    turn = np.where(rods % 2, -1.0, 1.0)  # neighbours are tilted the other way
    ripple = _BEAM_M * math.tan(math.radians(chain.tilt_deg))
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
    air = chain.chain.alike  # else κ is not one number
    prior = np.concatenate(
        [[0.0, 0.0, 0.0, DRAG_U**-2 if air else _FIXED], np.ones(common.shape[1])]
    )
    # The parabola is near enough for a few steps; a check needs no test of whether they end.
    for _ in range(_STEPS):
        at, release, g, kappa = point
        since = np.maximum(time - release, 0.0)
        still = np.zeros_like(since)
        fallen, end, _, by_gravity, by_kappa = leg_slopes(since, still, g, kappa)
        design = np.stack([np.ones_like(time), end, -by_gravity, -by_kappa], axis=1)
        whole = np.column_stack([design, common]) / sigma[:, None]
        inverse = np.linalg.inv(whole.T @ whole + np.diag(prior))
        off = np.concatenate([[0.0, 0.0, 0.0, kappa], np.zeros(common.shape[1])])
        residual = (height - at + fallen) / sigma
        best = inverse @ (whole.T @ residual - prior * off)
        point = point + best[:4]
    left = residual - whole @ best
    chi2 = float(left @ left + best[4:] @ best[4:])
    scatter2 = max(1.0, chi2 / (height.size - 3 - air))
    fitted = math.sqrt(scatter2 * float(inverse[2, 2]))
    value = float(point[2])
    return Measured(value, math.hypot(fitted, 2.0 * value * scale.u))
