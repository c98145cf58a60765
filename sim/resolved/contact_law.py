"""What damps a touch so that it throws back with the restitution asked for."""

from __future__ import annotations

import math

DEADEST = 0.1
"""The least restitution; d goes with 1/e, and the step that it needs with that."""


def damping(restitution: float) -> float:
    """Find d, which solves d (1 + e) = ln((1 + d)/(1 − e d)): the free bounce's first integral.

    Parameters
    ----------
    restitution
        In [`DEADEST`, 1].
    """
    e = restitution
    low, high = 0.0, 1.0 / e
    for _ in range(200):
        d = 0.5 * (low + high)
        spent = 1.0 - e * d
        if spent <= 0.0 or d * (1.0 + e) < math.log1p(d) - math.log(spent):
            high = d
        else:
            low = d
    return low
