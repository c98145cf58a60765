"""A camera as the paper used it (section II): the same fall by another instrument.

Δz is read off the last frame before the impact, V from a straight line through the last four.
Both are biased: the last frame comes up to 1/480 s early, and a line through a curve has the
slope of its middle. Reading a blurred rod adds noise.
"""

from __future__ import annotations

from statistics import fmean
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np

FRAME_RATE_HZ = 480.0
SPEED_FRAMES = 4
POSITION_NOISE_M = 0.5e-3


def camera_reading(
    impact_top: Callable[[float], float],
    free_top: Callable[[float], float],
    hit_s: float,
    rng: np.random.Generator,
) -> tuple[float, float]:
    """Δz, m, and V, m/s, as read off one video whose frames fall anywhere.

    Parameters
    ----------
    impact_top, free_top
        Height of each top rod's middle against time, m.
    hit_s
        When the impact chain's top rod hits.
    """
    phase = float(rng.uniform(0.0, 1.0))  # of a frame, between the last one and the impact
    times = [hit_s - (phase + i) / FRAME_RATE_HZ for i in range(SPEED_FRAMES)]
    noise = rng.normal(0.0, POSITION_NOISE_M, SPEED_FRAMES + 1).tolist()
    struck = [impact_top(t) + e for t, e in zip(times, noise, strict=False)]
    middle = fmean(times)
    spread = sum((t - middle) ** 2 for t in times)
    slope = sum((t - middle) * z for t, z in zip(times, struck, strict=True)) / spread
    return free_top(times[0]) + noise[-1] - struck[0], -slope
