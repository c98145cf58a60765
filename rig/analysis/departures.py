"""How chains and rods depart from Eqs. 8 to 13: stretch, air, slack strings and swing.

**Stretch.** The equations assume inelastic strings. Real strings rebound: 60 ms after the first
strike the top rod of resolved falls is up to 4 mm ahead of its place, while the middle of the chain
is not, and neighbouring rods depart alike. As independent departures of edges this would average
out and bias the release. So each drop has a few smooth modes: powers of a rod's place along the
chain, and the chain as a whole, times a function that grows in time and a function that soon
becomes constant.

**Air** drags a rod in proportion to its width over its mass. By itself, a rod of κ′ would lag
behind a chain of κ by (κ′ − κ)s²/3 after a distance s, to first order. Strings hold it back, and
edges determine how much of it is left. In resolved falls of rods of 6 to 32 mm the lag is 2 mm.
Without it, the free chain's g is 0.1 to 0.2 % too low. In addition, each rod lags until its own
strings are taut. At the release they are not: rods hang tilted, and of a rod's two strings one is
**slack** by a fraction of a millimetre. Part of this slack is the same for a chain in all drops,
and part differs from drop to drop.

**Swing.** No torque acts on a falling chain, so it turns at the constant rate ω of the release.
After a time t it has turned by ωt, and a rod at s above the centre of mass is lower than on a
straight chain by ½sω²t².
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from rig.analysis.chain_records import ChainRecord
from rig.analysis.trajectory import Trajectory, free_trajectory, struck_trajectory
from rig.arrays import Array, Index
from rig.model.chain import Chain
from rig.protocol.protocol import Contact, Protocol

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

SLACK_WAY = 0.5
"""Distance within which strings become taut, m: 0.3 to 0.8 give the same coverage."""


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
        Gain of speed of the top rod for α = 1 by the impulses after its last passage of a beam, m/s
        (at least by the last, which may come late), and the distance over which they come, m.
    """

    nominal: Trajectory
    stretch: Array
    lead: float
    late_pull: float
    late_way: float

    @classmethod
    def of(cls, record: ChainRecord, protocol: Protocol, kappa: float) -> Discrepancy:
        """Return the discrepancy on the chain's nominal fall with drag κ, 1/m."""
        assert record.ratios is not None
        strikes, gains = record.strikes, np.full(record.strikes.size, record.alpha)
        start, gravity = max(protocol.drop.value, LOWEST_START), protocol.gravity.value
        nominal = struck_trajectory(
            0.0, start, gravity, gains, record.ratios, strikes, kappa, record.air
        )
        stretch = stretch_modes(nominal, record.due.rods, record.due.levels)
        free = free_trajectory(0.0, start, gravity, kappa, record.air)
        lead = float((free.heights(nominal.time[-1:])[0] - nominal.height[-1:])[0])
        if nominal.hits is None or strikes.size < 2:
            return cls(nominal, stretch, lead, 0.0, 0.0)
        gap = float(strikes[-1] - strikes[-2])
        seeing = record.due.gate[record.due.rods == strikes.size - 1].tolist()
        lowest = min((protocol.gates.gates[gate].height for gate in seeing), default=gap)
        unseen = strikes[-1] - strikes[:-1] <= max(lowest, gap)
        pulls, length = (nominal.hits.ratio * nominal.hits.arrival)[:-1], float(np.ptp(strikes))
        return cls(nominal, stretch, lead, float(pulls @ unseen), min(max(lowest, 0.0), length))

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


def lags(record: ChainRecord, drop: float, rods: Index, levels: Array) -> Array:
    """Return the lag of rods behind their chain, for κ = 1/m.

    Parameters
    ----------
    drop
        Drop height of the chain, m.
    rods, levels
        Rods, and heights of the chain's reference point, m; shape ``(moments,)``.

    Returns
    -------
    ndarray
        m, shape ``(moments,)``.
    """
    way = np.maximum(drop - levels, 0.0)
    return np.asarray(record.unlike.take(rods, mode="wrap") * way**2 / 3.0)


def slack(record: ChainRecord, drop: float, rods: Index, levels: Array) -> Array:
    """Return the lag of rods behind their chain by slack, for slack of 1 m at each rod.

    Parameters
    ----------
    drop, rods, levels
        As for `lags`.

    Returns
    -------
    ndarray
        Shape ``(moments, rods)``.
    """
    way = np.maximum(drop - levels, 0.0)
    taut = -np.expm1(-((way / SLACK_WAY) ** 2))
    return np.asarray(np.eye(record.chain.chain.rods)[rods] * taut[:, None])


@lru_cache(maxsize=64)  # a session needs the same two for every drop
def lever(chain: Chain) -> Array:
    """Return the height of each rod above the centre of mass, m; shape ``(rods,)``."""
    heights = np.array(chain.heights)
    levers: Array = heights - np.average(heights, weights=chain.masses)
    levers.flags.writeable = False
    return levers


def drawn(lever: Array, protocol: Protocol, levels: Array) -> Array:
    """Return how much lower rods are than on a straight chain, for ω = 1 rad/s.

    Uses ½t² = (start − level)/g; after impacts, t is slightly shorter.

    Parameters
    ----------
    lever
        Height of each rod above the centre of mass, m.
    levels
        Levels of the reference point, m, of the same shape.

    Returns
    -------
    ndarray
        m for ω² = 1/s², of the same shape.
    """
    return lever * np.maximum(protocol.drop.value - levels, 0.0) / protocol.gravity.value


def strike_u(record: ChainRecord, protocol: Protocol) -> Array:
    """Return the standard uncertainty of each rod's strike height, m.

    A rod may strike the previous rod, which may be thicker than stated; the top rod only if its
    strike is not stated. On an inclined board a rod strikes lower if it moves sideways: a bottom
    rod released down the slope with the prior standard deviation of its speed, and a top rod at
    rest. A vertical board sets no limit, but no rod strikes lower than it fell.
    """
    chain, stated = record.chain.chain, protocol.contact.strike
    u = np.full(chain.rods, stated.u)
    if record.chain.diameters and stated.u:
        upper = slice(1, None if stated == Contact().strike else -1)
        u[upper] = np.maximum(stated.u, record.chain.diameters)[: u[upper].size]
    share = (chain.heights[-1] - np.array(chain.heights)) / (chain.length or 1.0)
    fallen = np.maximum(protocol.drop.value + record.strikes, 0.0)
    carried = protocol.priors.swing * share * np.sqrt(2.0 * fallen / protocol.gravity.value)
    lower = np.minimum(carried * math.tan(math.radians(record.incline_deg)), fallen)
    return np.asarray(np.hypot(u, lower), dtype=np.float64)


def swing_sd(chain: Chain, protocol: Protocol) -> float:
    """Return the prior standard deviation of ω², from that of the bottom rod's speed, 1/s².

    The square of a normal speed has the root mean square √3 σ².
    """
    return math.sqrt(3.0) * (protocol.priors.swing / chain.length) ** 2
