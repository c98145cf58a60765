"""Volts or light as a signal that is high or low: where they cross the middle between two levels.

They become levels with hysteresis around the middle between dark and bright; they change where a
straight line between two samples crosses that middle.
"""

from __future__ import annotations

import numpy as np

from rig.arrays import Array

_HYSTERESIS = 0.2
"""Share of the swing between dark and bright, half of it on either side of the middle."""
_CLEAR_SWING = 8.0
"""Swing over the noise of each level below which there is no passage to be seen."""
_SCATTER = 1.4826
"""Standard deviation over the median of absolute deviations, of normal noise."""


def find_crossings(samples: Array, threshold: tuple[float, float]) -> Array:
    """Return where volts cross a threshold, with 1 where they rise and 0 where they fall.

    Parameters
    ----------
    samples
        Line, time and volts of each.

    Returns
    -------
    array
        Of each crossing the line of the sample behind it, its moment, and the level that begins.
    """
    lines, times, volts = samples.T
    is_high = volts > threshold[0]
    sure = np.flatnonzero(np.abs(volts - threshold[0]) > threshold[1])
    turns = sure[1:][is_high[sure[1:]] != is_high[sure[:-1]]]
    crossings = np.flatnonzero(is_high[1:] != is_high[:-1]) + 1
    at = crossings[np.searchsorted(crossings, turns, side="right") - 1]
    share = (volts[at] - threshold[0]) / (volts[at] - volts[at - 1])
    return np.array([lines[at], times[at] - share * (times[at] - times[at - 1]), is_high[at]]).T


def find_threshold(volts: Array) -> tuple[float, float] | None:
    """Return the middle between two levels, and half the hysteresis; `None` without two levels."""
    low, high = float(volts.min(initial=np.inf)), float(volts.max(initial=-np.inf))
    for _ in range(10):  # two means, one for each level: of two levels, two or three are enough
        above = volts > 0.5 * (low + high)
        if above.all() or not above.any():
            return None
        low, high = float(np.median(volts[~above])), float(np.median(volts[above]))
    levels = (above, high), (~above, low)
    noise = max(float(np.median(np.abs(volts[side] - level))) for side, level in levels)
    if high - low < _CLEAR_SWING * _SCATTER * noise:
        return None
    return 0.5 * (low + high), 0.5 * _HYSTERESIS * (high - low)
