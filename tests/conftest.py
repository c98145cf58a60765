"""What holds for every test."""

from __future__ import annotations

import os

from hypothesis import settings

# As the `rig` command does, before numpy is loaded: with several threads a sum's last digits
# depend on how busy the machine is, and replays are compared to the last digit.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# A busy machine is no fault of the code: no example is timed.
settings.register_profile("rig", deadline=None)
settings.load_profile("rig")
