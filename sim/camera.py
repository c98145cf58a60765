"""The paper's own instrument beside the same fall, with the noise of reading a blurred rod."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.model.camera import SPEED_FRAMES, frame_times, read_frames

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np

POSITION_NOISE_M = 0.5e-3


def camera_reading(
    impact_top: Callable[[float], float],
    free_top: Callable[[float], float],
    hit_s: float,
    rng: np.random.Generator,
) -> tuple[float, float]:
    """Δz and V as read off one video whose frames fall anywhere.

    Parameters
    ----------
    impact_top, free_top
        Height of each top rod's middle against time, m.
    hit_s
        When the impact chain's top rod hits.
    """
    times = frame_times(hit_s, float(rng.uniform(0.0, 1.0)))
    noise = rng.normal(0.0, POSITION_NOISE_M, SPEED_FRAMES + 1).tolist()
    struck = [impact_top(t) + e for t, e in zip(times, noise, strict=False)]
    reading = read_frames(times, struck, free_top(times[0]) + noise[-1])
    return reading.separation_m, reading.speed_m_s
