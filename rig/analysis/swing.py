"""Fall of a chain that swings at the release: it turns, and its ends approach its middle.

No torque acts on a falling chain, so it turns at the constant rate ω of the release. After a time t
it has turned by ωt, and a rod at s above the centre of mass is lower than on a straight chain by
½sω²t².
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from rig.analysis.chain_records import ChainRecord
from rig.arrays import Array
from rig.model.chain import Chain
from rig.protocol.protocol import Protocol


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


def strike_shifts(record: ChainRecord, protocol: Protocol) -> Array:
    """Return how much lower each rod strikes an inclined board because of its sideways motion, m.

    For a bottom rod released down the slope with the prior standard deviation of its speed, and a
    top rod at rest. A vertical board sets no limit, but no rod strikes lower than it fell.
    """
    chain = record.chain.chain
    share = (chain.heights[-1] - np.array(chain.heights)) / chain.length
    fallen = np.maximum(protocol.drop.value + record.strikes, 0.0)
    carried = protocol.priors.swing * share * np.sqrt(2.0 * fallen / protocol.gravity.value)
    return np.minimum(carried * math.tan(math.radians(record.incline_deg)), fallen)


def swing_sd(chain: Chain, protocol: Protocol) -> float:
    """Return the prior standard deviation of ω², from that of the bottom rod's speed, 1/s².

    The square of a normal speed has the root mean square √3 σ².
    """
    return math.sqrt(3.0) * (protocol.priors.swing / chain.length) ** 2
