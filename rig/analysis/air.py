"""What the air takes from a chain, and from its rods, which may be unlike.

What the air takes goes with a rod's width over its mass. Left alone a rod of κ′ would lag behind a
chain of κ by (κ′ − κ)s²/3 after a way s, to first order. Strings leave it alone until they are
taut, and hold it from then on: so the lag has a part that grows with s² and one that grows with s,
and edges tell how much of either there is. In resolved falls of rods of 6 to 32 mm it is 2 mm; left
out, the free chain's g reads 0.1 to 0.2 % low.

Each rod of a chain that falls freely besides lags on until its own strings are taut. They are not
at the release: rods hang tilted, and of a rod's two strings one is slack by a part of a millimetre.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rig.predictions import air_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.analysis.chain_records import ChainRecord
    from rig.arrays import Array, Index
    from rig.model.chain import Chain
    from rig.protocol.protocol import Protocol


SLACK_WAY = 0.5
"""Within which strings become taut, m: 0.3 to 0.8 cover alike."""


def prior_air(protocol: Protocol) -> tuple[float, float]:
    """κ of the first chain as a whole as it is known beforehand, 1/m, and its uncertainty."""
    if protocol.drag is None:
        return 0.0, protocol.priors.drag
    kappa = air_of(protocol, next(iter(protocol.chains)))[0]
    return kappa, kappa * protocol.drag.relative_u


def unlike(chain: Chain, shares: Sequence[float]) -> Array:
    """How much more the air takes from each rod than from its chain, in units of κ.

    Parameters
    ----------
    shares
        κ of each rod with all above it, in the same units.

    Returns
    -------
    ndarray
        Shape ``(rods,)``; of one element, zero, where all rods are alike.
    """
    masses = np.array(chain.masses)
    force = np.array(shares) * np.cumsum(masses[::-1])[::-1]
    more: Array = -np.diff(force, append=0.0) / masses - shares[0]
    return more if np.ptp(shares) else np.zeros(1)


def lags(record: ChainRecord, drop: float, rods: Index, levels: Array) -> Array:
    """How much higher than in their chain some rods are, by each part for κ = 1/m.

    Parameters
    ----------
    drop
        How high the chain hangs, m.
    rods, levels
        Which, and where the chain's reference point is then, m; shape ``(moments,)``.

    Returns
    -------
    ndarray
        m, shape ``(moments, 2)``.
    """
    way = np.maximum(drop - levels, 0.0)
    ways = np.stack([way**2, way * record.chain.chain.length], axis=1) / 3.0
    behind: Array = record.unlike.take(rods, mode="wrap")[:, None] * ways
    return behind


def slack(record: ChainRecord, drop: float, rods: Index, levels: Array) -> Array:
    """How much higher than in their chain some rods are, for slack strings of 1 m at each rod.

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
    own: Array = np.eye(record.chain.chain.rods)[rods] * taut[:, None]
    return own
