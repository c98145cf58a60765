"""The time scale of a simulated rig's clock."""

from __future__ import annotations

import numpy as np

from bench.studies.falls import HZ
from rig.clock.calibration import TimeScale

CLOCK_U = 1e-6
"""How well the time scale is known, relative: a few minutes of clock samples."""


def time_scale(seed: int) -> TimeScale:
    """Calibrate a rig's clock: it is off by chance, as far as it says."""
    hz = HZ * (1.0 + CLOCK_U * np.random.default_rng(seed).normal())
    return TimeScale(float(hz), CLOCK_U)
