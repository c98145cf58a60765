"""Smooth model discrepancy: the stretch of a chain by its strings, which Eqs. 8 to 13 leave out.

The equations assume inelastic strings. Real strings rebound: 60 ms after the first strike the top
rod of resolved falls is up to 4 mm ahead of its place, while the middle of the chain is not, and
neighbouring rods depart alike. As independent departures of edges this would average out and bias
the release. So each drop has a few smooth modes: powers of a rod's place along the chain, and the
chain as a whole, times a function that grows in time and a function that soon becomes constant.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rig.analysis.chain_records import ChainRecord
from rig.analysis.equations import ExpectedEdges
from rig.analysis.trajectory import Trajectory, free_trajectory, struck_trajectory
from rig.arrays import Array, Index
from rig.protocol.protocol import Protocol

LOWEST_START = 1e-3
"""Least drop height of a striking chain, m: a trial step may go below the surface."""

_POWERS = {0.0: 0.5, 2.0: 1.0, 6.0: 1.0}
"""Powers of a rod's place (0 at the bottom, 1 at the top) with amplitudes. Power 0 is a delay of
the whole chain, as strings transmit a pull gradually: 0.25 to 1 give the same coverage, as does a
power 3 in addition."""
_GROWTH = 3.0
"""Growth of the growing mode until the last strike, in amplitudes of the constant mode."""
_SOON = 6.0
"""Time constants of the constant mode between first and last strike: 50 of 320 ms."""
MODES = 2 * len(_POWERS)
STRETCHES = ("stretch", "usual stretch")
"""Blocks of unknowns: of a drop alone, and shared by all drops of a condition."""


@dataclass(frozen=True)
class Discrepancy:
    """Model discrepancy of a striking chain, evaluated on its nominal fall.

    Times at levels come from the nominal fall, which keeps the observation equations linear in the
    modes.

    Attributes
    ----------
    nominal
        The fall by the protocol.
    stretch
        `stretch_modes` at each expected edge, shape ``(edges, MODES)``.
    lead
        Distance by which impacts bring the chain ahead of a free fall until the last, m.
    late_pull, late_way
        Gain of speed of the top rod by the whole last impulse, m/s, and the distance below the
        lowest beam, m, where no edge measures that gain.
    """

    nominal: Trajectory
    stretch: Array
    lead: float
    late_pull: float
    late_way: float

    @classmethod
    def of(
        cls, record: ChainRecord, edges: ExpectedEdges, protocol: Protocol, kappa: float
    ) -> Discrepancy:
        """Return the discrepancy on the chain's nominal fall with drag κ, 1/m."""
        assert record.ratios is not None
        assert protocol.gates is not None
        strikes, gains = record.strikes, np.full(record.strikes.size, record.alpha)
        start, gravity = max(protocol.drop.value, LOWEST_START), protocol.gravity.value
        nominal = struck_trajectory(
            0.0, start, gravity, gains, record.ratios, strikes, kappa, record.air
        )
        stretch = stretch_modes(nominal, edges.rods, edges.levels)
        free = free_trajectory(0.0, start, gravity, kappa, record.air)
        lead = float((free.heights(nominal.time[-1:])[0] - nominal.height[-1:])[0])
        if nominal.hits is None or strikes.size < 2:
            return cls(nominal, stretch, lead, 0.0, 0.0)
        pull = abs(record.alpha) * float(nominal.hits.ratio[-2] * nominal.hits.arrival[-2])
        seeing = [train for train in record.trains if strikes.size - 1 in train.rods]
        lowest = min((protocol.gates.gates[beam.gate].height for beam in seeing), default=np.inf)
        hidden = max(0.0, min(lowest, float(strikes[-1] - strikes[-2])))
        return cls(nominal, stretch, lead, pull, hidden)

    def top(self, levels: Array) -> Array:
        """Return the modes of the top rod for levels of the reference point, m."""
        last = self.nominal.time.size - 2
        return stretch_modes(self.nominal, np.full(levels.shape, last), levels)


def stretch_modes(nominal: Trajectory, rods: Index, levels: Array) -> Array:
    """Return how far rods are ahead of their chain by each mode; zero for a single rod.

    Parameters
    ----------
    nominal
        A fall with impacts: modes begin at the first, and are scaled to the last.
    rods
        Rods counted from the bottom, shape ``(moments,)``.
    levels
        Levels of the reference point, m, shape ``(moments,)``.

    Returns
    -------
    ndarray
        In amplitudes, shape ``(moments, MODES)``.
    """
    last = nominal.time.size - 2
    if last < 1:
        return np.zeros((levels.size, MODES))
    first, lasting = float(nominal.time[1]), float(nominal.time[-1] - nominal.time[1])
    share = np.maximum(nominal.times(levels) - first, 0.0) / lasting
    along = np.stack([size * (rods / last) ** power for power, size in _POWERS.items()], axis=1)
    in_time = np.stack([_GROWTH * share, -np.expm1(-_SOON * share)], axis=1)
    modes: Array = along[:, :, None] * in_time[:, None, :]
    return modes.reshape(levels.size, MODES)
