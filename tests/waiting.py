"""Waiting for what must come: for the event itself, and never for a time that it should take."""

import os
import time
from collections.abc import Callable

PATIENCE_S = 120.0 * max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1))
"""Only what never comes takes longer: it grows with how many programs share each processor."""


def until(true: Callable[[], object], what: Callable[[], object] = lambda: "") -> None:
    """Wait for something to become true; else fail, and say what there is instead."""
    end = time.monotonic() + PATIENCE_S
    while not true():
        assert time.monotonic() < end, what()
        time.sleep(0.01)
