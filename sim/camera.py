"""The paper's own instrument: a 480 fps camera beside the same fall (section II)."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np

FRAME_RATE_HZ = 480.0
POSITION_NOISE_M = 0.5e-3
SPEED_FRAMES = 4


def camera_reading(
    impact_top: Callable[[float], float],
    free_top: Callable[[float], float],
    hit_s: float,
    rng: np.random.Generator,
) -> tuple[float, float]:
    """Δz and V as read off the video.

    Δz comes from the last frame before the hit, V from a line through the last four.

    Parameters
    ----------
    impact_top, free_top
        Height of each top rod's middle against time, m.
    hit_s
        When the impact chain's top rod hits.
    """
    last = hit_s - float(rng.uniform(0.0, 1.0)) / FRAME_RATE_HZ
    times = [last - i / FRAME_RATE_HZ for i in range(SPEED_FRAMES)]
    noise = rng.normal(0.0, POSITION_NOISE_M, SPEED_FRAMES + 1)
    heights = [impact_top(t) + float(e) for t, e in zip(times, noise, strict=False)]
    separation = free_top(last) + float(noise[-1]) - heights[0]
    middle = sum(times) / SPEED_FRAMES
    spread = sum((t - middle) ** 2 for t in times)
    slope = sum((t - middle) * z for t, z in zip(times, heights, strict=True)) / spread
    return separation, -slope
