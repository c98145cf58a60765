"""Waiting for what must come: for the event itself, and never for a time that it should take."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

PATIENCE_S = 120.0
"""Only what never comes takes longer, however busy the machine is."""


def until(true: Callable[[], object], what: Callable[[], object] = lambda: "") -> None:
    """Wait for something to become true; else fail, and say what there is instead."""
    end = time.monotonic() + PATIENCE_S
    while not true():
        assert time.monotonic() < end, what()
        time.sleep(0.01)
