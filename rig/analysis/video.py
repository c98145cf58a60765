"""Acceleration from a video of the same fall, for comparison with the gates."""

from dataclasses import dataclass

import numpy as np

from rig.analysis.result import Measured
from rig.arrays import Array
from rig.plain_data import Record

_BENT = 0.5
"""Correlation of neighbouring residuals above which frames do not follow a parabola."""
_ENOUGH = 8  # least number of frames for that correlation


@dataclass(frozen=True, slots=True)
class VideoFall(Record):
    """Acceleration by a video.

    Attributes
    ----------
    acceleration
        m/s²; its uncertainty is from the frames' scatter, without that of the video's length scale.
    frames
        Number of frames.
    bent
        Whether the frames depart from a parabola by more than chance.
    gates
        Acceleration by the gates, if they measured it.
    """

    MEMBERS = "acceleration_m_s2=acceleration frames bent normalized_error?"

    acceleration: Measured
    frames: int
    bent: bool
    gates: Measured | None

    @property
    def normalized_error(self) -> float | None:
        """E_n of the video's acceleration less that of the gates; within ±1 both agree."""
        if self.gates is None:
            return None
        return self.acceleration.less(self.gates).normalized_error or 0.0


def video_fall(times: Array, x: Array, y: Array, gates: Measured | None = None) -> VideoFall:
    """Fit parabolas to both coordinates; direction and origin do not matter.

    Parameters
    ----------
    times, x, y
        s and m, shape ``(frames,)``, at least 4 frames.
    gates
        As in `VideoFall`.
    """
    design = np.vander(times - times.mean(), 3)  # centred, for numerical accuracy
    inverse, places = np.linalg.pinv(design), x + 1j * y
    solved = inverse @ places
    residuals = places - design @ solved
    acceleration = 2.0 * solved[0]
    size = float(np.abs(acceleration))
    # Only scatter along the acceleration affects its size.
    off = (residuals * np.exp(-1j * np.angle(acceleration))).real
    degrees = times.size - 3
    u = 2.0 * float(np.sqrt(off @ off / degrees) * np.linalg.norm(inverse[0]))
    total = float(off @ off)
    neighbours = float(off[1:] @ off[:-1]) / total if total else 0.0
    bent = times.size >= _ENOUGH and neighbours > _BENT
    return VideoFall(Measured(size, u, float(degrees)), int(times.size), bent, gates)
