"""Means of runs, effects over blocks of runs and differences of means, each with its uncertainty.

All are sums of runs with weights. Of each run's variance a part is its own, and the rest is what
all runs of a rig have in common, which no number of runs averages: of runs of one joint fit it is
known with its sign, as the vectors `Measured.shared`, and may cancel (GUM 5.2.2). Of runs by
themselves only the sources are known.
"""

from __future__ import annotations

import math
from dataclasses import replace
from statistics import fmean, stdev, variance
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.quantities import COMMON
from rig.analysis.result import Measured

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from rig.arrays import Array


ABBA = (True, False, False, True)
"""Whether the first chain strikes in each run of a block."""
_CHAINS_OWN = ("spacing", "width")  # common lines of a budget that are not the same for both


def average(
    value: float, own: float, seen: float, freedom: float, common: float, runs: Sequence[Measured]
) -> Measured:
    """Put a mean, or another sum with weights, and its uncertainty together.

    Where runs happen to scatter less than each one's own uncertainty allows, the latter counts.
    Degrees of freedom are effective ones (GUM G.4): what runs say of themselves is known no better
    than they know it, however many they are.

    Parameters
    ----------
    own, seen
        Uncertainty by what the runs say of themselves, and by their scatter.
    freedom
        Degrees of freedom of the latter.
    common
        What all runs share, which averaging does not reduce.
    runs
        Of which the one that knows its own uncertainty least speaks for all.
    """
    single, degrees_alone = max(own, seen), min(max(1.0, run.degrees) for run in runs)
    u = math.hypot(single, common)
    share = single**4 / (freedom if seen > own else degrees_alone) + common**4 / degrees_alone
    degrees = u**4 / share if share > 0.0 else math.inf
    return Measured(value, u, degrees, {"runs": single, "common": common})


def mean(runs: Sequence[Measured]) -> Measured:
    """Mean of several runs: their scatter over √n, and what is common to all of them."""
    common, own = _common_part(runs), _own_variance(runs)
    values, n = [run.value for run in runs], len(runs)
    if n == 1:
        parts = {"runs": math.sqrt(own), "common": common}
        return replace(runs[0], budget=parts, shared=None, deviation=None)
    seen = stdev(values) / math.sqrt(n)
    return average(fmean(values), math.sqrt(own / n), seen, n - 1.0, common, runs)


def difference(runs: Sequence[Measured], reference: Sequence[Measured]) -> Measured:
    """Return the mean of some runs less that of others.

    Where both sets together scatter more than runs' own uncertainties say, their pooled scatter
    counts, as in Student's test of two means.
    """
    sets = (runs, reference)
    own = [_own_variance(members) for members in sets]
    foretold = math.sqrt(sum(part / len(each) for part, each in zip(own, sets, strict=True)))
    freedom = len(runs) + len(reference) - 2
    chi2 = sum(
        (len(members) - 1) * variance(run.value for run in members) / part
        for members, part in zip(sets, own, strict=True)
        if len(members) > 1 and part > 0.0
    )
    seen = foretold * math.sqrt(chi2 / freedom) if freedom else 0.0
    vectors = [_shared(members) for members in sets]
    if vectors[0] is not None and vectors[1] is not None:
        common = float(np.linalg.norm(vectors[0].mean(axis=0) - vectors[1].mean(axis=0)))
    else:
        common = math.hypot(*map(_common_part, sets))
    value = fmean(run.value for run in runs) - fmean(run.value for run in reference)
    return average(value, foretold, seen, freedom, common, [*runs, *reference])


def effect(blocks: Sequence[Sequence[Measured]], weights: Array) -> Measured:
    """Average a weighted sum over blocks of runs in the order `ABBA`.

    Its scatter is that between blocks and within them.
    """
    runs = [run for block in blocks for run in block]
    values = np.array([[run.value for run in block] for block in blocks])
    sums = values @ weights
    n, size = len(blocks), float(weights @ weights)
    # Within a block one sum is left that knows of no mean, no chain and no linear drift.
    design = np.stack([np.ones(len(ABBA)), np.arange(len(ABBA)), np.where(ABBA, 1.0, -1.0)])
    rest = np.linalg.svd(design)[2][-1]
    # Its square is of the runs' own scatter only: one more degree of freedom from each block.
    squares = float(np.sum((sums - sums.mean()) ** 2) + size * np.sum((values @ rest) ** 2))
    freedom = 2 * n - 1.0
    vectors = _shared(runs)
    if vectors is not None:
        common = float(np.linalg.norm(np.tile(weights, n) @ vectors / n))
    else:  # two chains share none of what is a chain's own, and all else cancels
        chains = math.hypot(weights[0] + weights[3], weights[1] + weights[2])
        common = chains * math.sqrt(fmean(_parts(runs, _CHAINS_OWN)))
    own = _own_variance(runs, _CHAINS_OWN) * size
    seen = math.sqrt(squares / freedom / n)
    return average(float(sums.mean()), math.sqrt(own / n), seen, freedom, common, runs)


def _shared(runs: Sequence[Measured]) -> Array | None:
    """Return what runs have in common, one row a run; `None` where that is not known of all."""
    rows = [run.shared for run in runs if run.shared is not None]
    return np.array(rows) if len(rows) == len(runs) else None


def _own_variance(runs: Sequence[Measured], lines: Iterable[str] = COMMON) -> float:
    """Mean of what of the runs' variances is each one's own."""
    return fmean(
        max(0.0, run.u**2 - part) for run, part in zip(runs, _parts(runs, lines), strict=True)
    )


def _common_part(runs: Sequence[Measured]) -> float:
    """What averaging leaves."""
    vectors = _shared(runs)
    if vectors is None:
        return math.sqrt(fmean(_parts(runs, COMMON)))
    return float(np.linalg.norm(vectors.mean(axis=0)))


def _parts(runs: Sequence[Measured], lines: Iterable[str]) -> list[float]:
    """What of each run's variance is common, by its lines where no more is known."""
    vectors = _shared(runs)
    if vectors is None:
        return [sum(run.budget.get(name, 0.0) ** 2 for name in lines) for run in runs]
    return [float(row @ row) for row in vectors]
