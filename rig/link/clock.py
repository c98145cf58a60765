"""The host's clock, which can be replaced."""

from __future__ import annotations

import time
from typing import Protocol


class Clock(Protocol):
    """Where time comes from; a simulated port brings its own."""

    def now_ns(self) -> int:
        """Monotonic host time."""
        ...

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        ...


class SystemClock:
    """The computer's monotonic clock."""

    def now_ns(self) -> int:
        """Monotonic host time."""
        return time.monotonic_ns()

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        time.sleep(seconds)
