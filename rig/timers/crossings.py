"""Volts or light as a signal that is high or low: where they cross the middle between two levels.

They become levels with hysteresis around the middle between dark and bright; they change where a
straight line between two samples crosses that middle.
"""

import numpy as np

from rig.arrays import Array

_HYSTERESIS = 0.2
"""Share of the swing between dark and bright, half of it on either side of the middle."""
_CLEAR_SWING = 8.0
"""Swing over the noise of each level below which there is no passage to be seen."""
_SCATTER = 1.4826
"""Standard deviation over the median of absolute deviations, of normal noise."""


def find_crossings(samples: Array) -> tuple[float | None, Array]:
    """Return the middle between two levels of volts, and where they cross it.

    Parameters
    ----------
    samples
        Line, time and volts of each.

    Returns
    -------
    middle
        `None` without two levels.
    crossings
        Of each the line of the sample behind it, its moment, and 1 where volts rise.
    """
    lines, times, volts = samples.T
    measured = volts[np.isfinite(volts)]
    if not measured.size:
        return None, samples[:0]
    low, high = measured.min(), measured.max()
    volts = volts.clip(low, high)
    for _ in range(10):  # two means, one for each level: of two levels, two or three are enough
        above = volts > 0.5 * (low + high)
        if above.all() or not above.any():
            return None, samples[:0]
        low, high = np.median(volts[~above]), np.median(volts[above])
    noise = max(np.median(np.abs(volts[~above] - low)), np.median(np.abs(volts[above] - high)))
    if high - low < _CLEAR_SWING * _SCATTER * noise:
        return None, samples[:0]
    middle = float(0.5 * (low + high))
    is_high = volts > middle
    sure = np.flatnonzero(np.abs(volts - middle) > 0.5 * _HYSTERESIS * (high - low))
    turns = sure[1:][np.diff(is_high[sure])]
    crossings = np.flatnonzero(np.diff(is_high)) + 1
    at = crossings[np.searchsorted(crossings, turns, side="right") - 1]
    # Rows of changes alone do not say what was between.
    share = (volts[at] - middle) / (volts[at] - volts[at - 1]) * (2 * at.size <= volts.size)
    moments = times[at] - share * (times[at] - times[at - 1])
    return middle, np.stack([lines[at], moments, is_high[at]], axis=1)
