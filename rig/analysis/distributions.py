"""Coverage factors of Student's t and tail probabilities of χ² and the binomial distribution.

scipy is imported on the first call: the import takes longer than the analysis of a drop, and
predictions, checks and plans do not need it.
"""

from functools import lru_cache
from typing import Any

BY_CHANCE = 1e-3
"""Probability below which something is not taken for chance."""


def special() -> Any:
    """Return `scipy.special`, loaded on the first call."""
    import scipy.special  # noqa: PLC0415 - see above

    return scipy.special


@lru_cache(maxsize=1024)
def coverage_factor(degrees: float, probability: float = 0.95) -> float:
    """Return the factor k for which ±k·u covers a share of the t distribution (GUM G.3).

    This is the quantile of t at (1 + probability)/2.

    Parameters
    ----------
    degrees
        ν ≥ 1, not necessarily whole; infinity gives the normal distribution.

    Raises
    ------
    ValueError
        Fewer than one degree of freedom.
    """
    if not degrees >= 1.0:  # NaN too
        raise ValueError(f"{degrees} degrees of freedom; at least 1 is needed")
    return float(special().stdtrit(degrees, 0.5 * (1.0 + probability)))


def chi2_tail(x: float, degrees: int) -> float:
    """Return the probability that χ² with these degrees of freedom is above x.

    Raises
    ------
    ValueError
        Fewer than one degree of freedom.
    """
    if not degrees >= 1:
        raise ValueError(f"{degrees} degrees of freedom; at least 1 is needed")
    # The difference of two equally good fits may be below zero by rounding.
    return float(special().chdtrc(degrees, max(x, 0.0)))


@lru_cache(maxsize=1024)
def most_by_chance(trials: int, share: float) -> int:
    """Return the number of missed edges that only 1 drop in 1000 exceeds by chance.

    Parameters
    ----------
    trials
        Number of edges.
    share
        Probability that an edge is missed, independently: the number is binomial.
    """
    return next(k for k in range(trials + 1) if special().bdtrc(k, trials, share) < BY_CHANCE)
