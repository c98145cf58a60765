"""Weighted normal equations of one drop."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from rig.analysis.drop_model import DropModel

    Array = NDArray[np.float64]
    Index = NDArray[np.intp]
    Matches = Mapping[str, Sequence[Index]]

HUBER = 4.0
"""Standard deviations beyond which an edge counts less."""
STRAY = 6.0
"""Standard deviations: no rod is that far off once everything was adjusted."""


@dataclass(frozen=True, slots=True)
class Normal:
    """½‖r/σ‖² about a point, to second order.

    Attributes
    ----------
    matrix
        JᵀWJ in units of the prior uncertainties, shape ``(unknowns, unknowns)``.
    vector
        JᵀWr likewise, shape ``(unknowns,)``.
    chi2, size
        Weighted sum of squares, and number of edges.
    """

    matrix: Array
    vector: Array
    chi2: float
    size: int


def normal(
    model: DropModel,
    matches: Matches,
    x: Array,
    sd: Array,
    inflation: float = 1.0,
    cut: float = math.inf,
) -> Normal:
    """Set up the normal equations; residuals beyond 4 σ weigh less (Huber).

    A side knows nothing of the other's unknowns: only its own are multiplied.

    Parameters
    ----------
    sd
        Prior standard uncertainties of the unknowns; where 0 the unknown stays as it is.
    inflation
        How much more the edges scatter than the model assumes.
    cut
        Standard deviations beyond which an edge does not count.
    """
    matrix, vector = np.zeros((x.size, x.size)), np.zeros(x.size)
    chi2, size = 0.0, 0
    for role, match in matches.items():
        (values, sigma, *_), slopes, columns, _ = model.equations(role, x, match)
        sigma = sigma * inflation
        residuals = values / sigma
        far = np.maximum(np.abs(residuals), 1e-300)
        weight = np.where(far > cut, 0.0, np.sqrt(np.minimum(1.0, HUBER / far)))
        residuals *= weight
        slopes *= (weight / sigma)[:, None]  # in place: nobody else has them
        matrix[np.ix_(columns, columns)] += slopes.T @ slopes
        vector[columns] += slopes.T @ residuals
        chi2 += float(residuals @ residuals)
        size += residuals.size
    # A column's unit is applied to few numbers instead of to each edge.
    matrix *= np.outer(sd, sd)
    return Normal(matrix, vector * sd, chi2, size)
