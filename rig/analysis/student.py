"""Student's t quantile, for any real number of degrees of freedom."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(64)
_MANY = 1e6  # beyond this the distribution is normal to the last digit that matters


@lru_cache(maxsize=1024)
def coverage_factor(degrees: float, probability: float = 0.95) -> float:
    """Factor k for which ±k·u covers a share of the t distribution (GUM G.3).

    With t = √ν tan φ the probability of |t| < k is an integral of cos^(ν−1) φ over a finite
    interval, smooth for ν ≥ 1, so Gauss–Legendre quadrature gives it to machine precision.

    Parameters
    ----------
    degrees
        ν ≥ 1; infinity gives the normal distribution.

    Raises
    ------
    ValueError
        For fewer than one degree of freedom.
    """
    if not degrees >= 1.0:  # not-a-number too
        raise ValueError(f"{degrees} degrees of freedom; at least 1 is needed")
    degrees = min(degrees, _MANY)
    norm = math.exp(math.lgamma((degrees + 1) / 2) - math.lgamma(degrees / 2)) / math.sqrt(math.pi)

    def covered(k: float) -> float:
        end = math.atan(k / math.sqrt(degrees))
        cosines = np.cos(0.5 * end * (_NODES + 1.0))
        return norm * end * float(_WEIGHTS @ cosines ** (degrees - 1.0))

    low, high = 0.0, 2.0
    while covered(high) < probability:
        high *= 2.0
    while high - low > 1e-12 * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if covered(middle) < probability else (low, middle)
    return 0.5 * (low + high)
