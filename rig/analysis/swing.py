"""How a chain that swings as it is let go falls: it turns, and its ends come nearer its middle.

Nothing turns a chain that falls, so that it goes on at the rate ω that it was let go with: by ωt
after a time t, and a rod at s above the centre of mass is lower than on a straight chain by ½sω²t².
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from rig.analysis.chain_records import ChainRecord
    from rig.arrays import Array
    from rig.model.chain import Chain
    from rig.protocol.protocol import Protocol


@lru_cache(maxsize=64)  # a session asks for the same two again and again
def lever(chain: Chain) -> Array:
    """How far each rod is above the centre of mass, m; shape ``(rods,)``."""
    heights = np.array(chain.heights)
    levers: Array = heights - np.average(heights, weights=chain.masses)
    levers.flags.writeable = False
    return levers


def drawn(lever: Array, protocol: Protocol, levels: Array) -> Array:
    """How much lower rods are than on a straight chain, for a chain that turns at 1 rad/s.

    By ½t² = (start − level)/g; where the chain was struck before it takes a little less.

    Parameters
    ----------
    lever
        Of each rod, see `lever`, m.
    levels
        Of the reference point, m; likewise.

    Returns
    -------
    ndarray
        m, of that shape.
    """
    return lever * np.maximum(protocol.drop.value - levels, 0.0) / protocol.gravity.value


def strike_shifts(record: ChainRecord, protocol: Protocol) -> Array:
    """How much lower on an inclined board each rod strikes for being carried along it, m.

    For a bottom rod that is let go down the slope with 1 m/s, and a top rod that rests.
    """
    chain = record.chain.chain
    share = (chain.heights[-1] - np.array(chain.heights)) / chain.length
    fallen = np.maximum(protocol.drop.value + record.strikes, 0.0)
    carried = share * np.sqrt(2.0 * fallen / protocol.gravity.value)
    lower: Array = carried * math.tan(math.radians(record.incline_deg))
    return lower


def swing_sd(chain: Chain, protocol: Protocol) -> float:
    """Standard deviation of ω² for what is known of the bottom rod's speed beforehand, 1/s².

    Of a normally distributed speed the square has √3 times the square of its standard deviation,
    about zero.
    """
    return math.sqrt(3.0) * (protocol.priors.swing / chain.length) ** 2
