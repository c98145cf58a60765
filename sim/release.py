"""The virtual board's release outputs: on for one pulse, then at rest for three times as long."""

from __future__ import annotations

from rig.link.messages import PulseEnd

REST = 3
"""Rest after a pulse, in lengths of that pulse: a coil is on for a quarter of the time at most."""


class Release:
    """All release outputs together; they rest together too."""

    def __init__(self) -> None:
        self._mask = 0
        self._on_ns = 0
        self._off_ns = 0
        self._end = PulseEnd.ORDERED

    def pulse(self, mask: int, now_ns: int, pulse_us: int) -> None:
        """Switch on, for a time."""
        self._mask = mask
        self._on_ns = now_ns
        self._off_ns = now_ns + pulse_us * 1000
        self._end = PulseEnd.ORDERED

    def off(self, now_ns: int, by: PulseEnd) -> None:
        """Switch off now, if on."""
        if now_ns < self._off_ns:
            self._off_ns, self._end = now_ns, by

    def latest_pulse(self) -> tuple[int, PulseEnd]:
        """Nanoseconds of the latest pulse, once it is over, and what ended it."""
        return self._off_ns - self._on_ns, self._end

    def on(self, now_ns: int) -> int:
        """Mask of the outputs that are on."""
        return self._mask if now_ns < self._off_ns else 0

    def cooling_ms(self, now_ns: int) -> int:
        """Milliseconds of rest still owed, rounded up."""
        rested_ns = self._off_ns + REST * (self._off_ns - self._on_ns)
        return max(0, -((now_ns - rested_ns) // 10**6))
