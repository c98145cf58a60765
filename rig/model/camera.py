"""A camera as the paper used it: what a fall looks like to it (section II).

Δz is read off the last frame before the impact, V from a straight line through the last four.
Both are biased: the last frame comes up to 1/480 s early, and a line through a curve has the
slope of its middle.
"""

from __future__ import annotations

from dataclasses import dataclass
from statistics import fmean
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

FRAME_RATE_HZ = 480.0
SPEED_FRAMES = 4


@dataclass(frozen=True, slots=True)
class Reading:
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


def read_frames(times: Sequence[float], struck: Sequence[float], free_height: float) -> Reading:
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
    return Reading(free_height - struck[0], -slope)
