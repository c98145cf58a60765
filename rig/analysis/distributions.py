"""Student's t and χ²: how far uncertainties reach, and how likely a misfit is.

scipy is loaded on the first call and not before: it takes longer to import than a drop to analyse,
and a prediction, a check or a plan asks for neither.
"""

from __future__ import annotations

from functools import lru_cache

COVERAGE_95 = 1.959963984540054
"""`coverage_factor` of the normal distribution, for where scipy is not worth its import."""
_ONCE_IN = 1e-3
_MANY = 1e6  # beyond this the distribution is normal to the last digit that anybody is shown


@lru_cache(maxsize=1024)
def coverage_factor(degrees: float, probability: float = 0.95) -> float:
    """Factor k for which ±k·u covers a share of the t distribution (GUM G.3).

    It is the quantile of t at (1 + probability)/2.

    Parameters
    ----------
    degrees
        ν ≥ 1, not necessarily whole; infinity gives the normal distribution.

    Raises
    ------
    ValueError
        For fewer than one degree of freedom.
    """
    from scipy.special import stdtrit  # noqa: PLC0415 - see above

    if not degrees >= 1.0:  # not-a-number too
        raise ValueError(f"{degrees} degrees of freedom; at least 1 is needed")
    return float(stdtrit(min(degrees, _MANY), 0.5 * (1.0 + probability)))


def chi2_tail(x: float, degrees: int) -> float:
    """Probability that χ² of so many degrees of freedom is above x.

    Raises
    ------
    ValueError
        For less than one degree of freedom.
    """
    from scipy.special import chdtrc  # noqa: PLC0415 - see above

    if degrees < 1:
        raise ValueError(f"{degrees} degrees of freedom; at least 1 is needed")
    # The difference of two equally good fits may be below zero by rounding.
    return float(chdtrc(degrees, max(x, 0.0)))


@lru_cache(maxsize=1024)
def most_by_chance(trials: int, share: float) -> int:
    """Return how many of so many edges are missed at most, but for one drop in a thousand.

    Parameters
    ----------
    trials
        Number of edges.
    share
        Chance of each to be missed, independently: their number is binomial.
    """
    from scipy.special import bdtrc  # noqa: PLC0415 - see above

    return next(k for k in range(trials + 1) if bdtrc(k, trials, share) < _ONCE_IN)
