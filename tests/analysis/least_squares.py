"""Least squares of anything: observations that are no edges."""

import numpy as np

from rig.analysis.equations import Linearization
from rig.analysis.square_root import EquationRows


def plain_equations(residuals: np.ndarray, slopes: np.ndarray) -> Linearization:
    """Set up observations that are all good, in standard deviations of each."""
    chi2 = float(residuals @ residuals)
    rows = EquationRows(slopes, residuals, np.arange(slopes.shape[1]))
    return Linearization({"": rows}, chi2, residuals.size, chi2)
