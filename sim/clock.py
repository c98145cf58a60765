"""Virtual time: it passes only when somebody waits."""

from __future__ import annotations

import time


class VirtualClock:
    """A clock that jumps over waiting.

    Parameters
    ----------
    pace
        Real seconds a virtual second shall take: 0 for as fast as possible, 1 for a demonstration
        that looks like the real thing.
    """

    def __init__(self, pace: float = 0.0) -> None:
        self._pace = pace
        self._now_ns = 0

    def now_ns(self) -> int:
        """Virtual time."""
        return self._now_ns

    def sleep(self, seconds: float) -> None:
        """Let virtual time pass."""
        self.advance_to(self._now_ns + round(seconds * 1e9))

    def advance_to(self, when_ns: int) -> None:
        """Go to a moment; one that is over already changes nothing.

        Parameters
        ----------
        when_ns
            Virtual time to be reached.
        """
        if when_ns > self._now_ns:
            if self._pace > 0:
                time.sleep((when_ns - self._now_ns) * 1e-9 * self._pace)
            self._now_ns = when_ns
