"""A camera as the paper used it (section II): the same fall by another instrument.

Δz is read off the last frame before the impact, V from a straight line through the last four.
Both are biased: the last frame comes up to 1/480 s early, and a line through a curve has the
slope of its middle. Reading a blurred rod adds noise.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

FRAME_RATE_HZ = 480.0
SPEED_FRAMES = 4
POSITION_NOISE_M = 0.5e-3


def camera_reading(
    impact_top: Callable[[Any], Any],
    free_top: Callable[[Any], Any],
    hit_s: float,
    rng: np.random.Generator,
) -> tuple[float, float]:
    """Δz, m, and V, m/s, as read off one video whose frames fall anywhere.

    Parameters
    ----------
    impact_top, free_top
        Heights of each top rod's middle at some times, m.
    hit_s
        When the impact chain's top rod hits.
    """
    phase = rng.uniform(0.0, 1.0)  # of a frame, between the last one and the impact
    times = hit_s - (phase + np.arange(SPEED_FRAMES)) / FRAME_RATE_HZ
    *noise, last = rng.normal(0.0, POSITION_NOISE_M, SPEED_FRAMES + 1)
    struck = impact_top(times) + noise
    slope, _ = np.polyfit(times - times.mean(), struck, 1)
    return float(free_top(times[0]) + last - struck[0]), -float(slope)
