"""Where a further gate would tell two readings of the same edges apart."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rig.protocol.gates import CLEARANCE_M

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rig.analysis.fit import Fit

    Array = NDArray[np.float64]

_STEP = 4e-3  # between heights that are tried, m


def deciding_gate(one: Fit, other: Fit) -> tuple[str, float]:
    """Find the beam that would see two falls differ most.

    A beam tells no rod by itself: of each edge of one fall it is compared how far the chain is from
    where the other fall has its nearest edge. On average over all edges that is most where rods
    come by at unlike intervals, or first and last ones at unlike moments.

    Parameters
    ----------
    one, other
        Readings of the same drop.

    Returns
    -------
    role, height
        On which side, and how high above the zero of the protocol's heights, m. No hanging rod
        blocks it.
    """
    best = ("", 0.0, -1.0)
    protocol = one.model.protocol
    zero = 0.0 if protocol.stated is None else protocol.stated.drop.value - protocol.drop.value
    for role, record in one.model.records.items():
        paths = [fit.model.trajectory(role, fit.x) for fit in (one, other)]
        places, drop = np.array(record.chain.chain.heights), one.model.protocol.drop
        start, blocked = drop.value, np.array(record.chain.widths) / 2.0 + max(CLEARANCE_M, drop.u)
        top = start + float(places.max())
        for height in np.arange(_STEP, top, _STEP).tolist():
            if np.any(np.abs(start + places - height) < blocked):
                continue
            levels = np.sort(height - places)[::-1]
            levels = levels[levels < min(float(path.height[0]) for path in paths)]
            if record.ratios is not None:
                levels = levels[levels > -places.max()]
            if levels.size == 0:
                continue
            mine, theirs = (path.times(levels) for path in paths)
            far = _apart(mine, theirs) * paths[0].heights(mine)[1]
            if (mean := float(far.mean())) > best[2]:
                best = role, height, mean
    return best[0], best[1] + zero


def _apart(times: Array, others: Array) -> Array:
    """How far each time is from the nearest of some others, s."""
    found: Array = np.abs(times[:, None] - others[None, :]).min(axis=1)
    return found
