"""Air drag on a chain and on its rods, which may differ: prior, lags and slack.

Drag on a rod is proportional to its width over its mass. By itself, a rod of κ′ would lag behind a
chain of κ by (κ′ − κ)s²/3 after a distance s, to first order. Strings hold it back, and edges
determine how much of it is left. In resolved falls of rods of 6 to 32 mm the lag is 2 mm. Without
it, the free chain's g is 0.1 to 0.2 % too low.

In addition, each rod lags until its own strings are taut. At the release they are not: rods hang
tilted, and of a rod's two strings one is slack by a fraction of a millimetre. Part of this slack is
the same for a chain in all drops, and part differs from drop to drop.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rig.arrays import Array, Index
from rig.model.chain import Chain
from rig.predictions import air_of
from rig.protocol.protocol import Protocol

if TYPE_CHECKING:
    from rig.analysis.chain_records import ChainRecord


SLACK_WAY = 0.5
"""Distance within which strings become taut, m: 0.3 to 0.8 give the same coverage."""


def prior_air(protocol: Protocol) -> tuple[float, float]:
    """Return the prior mean and standard uncertainty of κ of the first chain as a whole, 1/m."""
    if protocol.drag is None:
        return 0.0, protocol.priors.drag
    kappa = air_of(protocol, next(iter(protocol.chains)))[0]
    return kappa, kappa * protocol.drag.relative_u


def unlike(chain: Chain, shares: Sequence[float]) -> Array:
    """Return κ of each rod alone less that of its chain, in units of κ.

    Parameters
    ----------
    shares
        κ of each rod together with all above it, in the same units.

    Returns
    -------
    ndarray
        Shape ``(rods,)``, or a single zero if all rods are alike.
    """
    masses = np.array(chain.masses)
    force = np.array(shares) * np.cumsum(masses[::-1])[::-1]
    more: Array = -np.diff(force, append=0.0) / masses - shares[0]
    return more if np.ptp(shares) else np.zeros(1)


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
    behind: Array = record.unlike.take(rods, mode="wrap") * way**2 / 3.0
    return behind


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
    own: Array = np.eye(record.chain.chain.rods)[rods] * taut[:, None]
    return own
