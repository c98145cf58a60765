"""The upper tail of χ², for whole numbers of degrees of freedom."""

from __future__ import annotations

import math


def chi2_tail(x: float, degrees: int) -> float:
    """Probability that χ² of so many degrees of freedom is above x.

    The finite sums of Abramowitz and Stegun 26.4.4 and 26.4.5, each term in logarithms.

    Raises
    ------
    ValueError
        For less than one degree of freedom.
    """
    if degrees < 1:
        raise ValueError(f"{degrees} degrees of freedom; at least 1 is needed")
    if x <= 0.0:
        return 1.0
    half, odd = 0.5 * x, degrees % 2
    found = math.erfc(math.sqrt(half)) if odd else 0.0
    powers = [j + 0.5 * odd for j in range(degrees // 2)]
    found += math.fsum(
        math.exp(power * math.log(half) - half - math.lgamma(power + 1.0)) for power in powers
    )
    return min(1.0, found)
