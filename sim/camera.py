"""A camera as the paper used it (section II): the same fall by another instrument.

Δz is read off the last frame before the impact, V from a straight line through the last four.
Both are biased: the last frame comes up to 1/480 s early, and a line through a curve has the
slope of its middle. Reading a blurred rod adds noise.
"""

from __future__ import annotations

from dataclasses import dataclass
from statistics import fmean
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy as np

FRAME_RATE_HZ = 480.0
SPEED_FRAMES = 4
POSITION_NOISE_M = 0.5e-3


@dataclass(frozen=True, slots=True)
class FrameReading:
    """What one video says: Δz in m and V in m/s."""

    separation_m: float
    speed_m_s: float


def frame_times(hit_s: float, phase: float, rate_hz: float = FRAME_RATE_HZ) -> list[float]:
    """Times of the last four frames before an impact, last first.

    Parameters
    ----------
    hit_s
        The impact.
    phase
        How much of a frame passes between the last frame and the impact, 0 to 1.
    """
    return [hit_s - (phase + i) / rate_hz for i in range(SPEED_FRAMES)]


def read_frames(
    times: Sequence[float], struck: Sequence[float], free_height: float
) -> FrameReading:
    """Read Δz and V off frames, the last first.

    Parameters
    ----------
    times
        Of the frames, s.
    struck
        Height of the striking chain's top rod in each, m.
    free_height
        Height of the free chain's top rod in the last frame, m.
    """
    middle = fmean(times)
    spread = sum((t - middle) ** 2 for t in times)
    slope = sum((t - middle) * z for t, z in zip(times, struck, strict=True)) / spread
    return FrameReading(free_height - struck[0], -slope)


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
