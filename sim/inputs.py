"""What is wired to the virtual board besides the gates; a reset of the board changes none of it."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field


@dataclass(slots=True)
class Inputs:
    """Emergency stop, 1 Hz reference and release sense.

    Attributes
    ----------
    stopped
        Whether the emergency stop counts as open.
    stop_turns_ns
        When it will count as what it is now; `None` while it does.
    pulses_ns
        When the reference will give a pulse, in order of time.
    period_ns
        After the last of these it goes on with this period; 0 for not at all.
    sense_s
        How long after a release fires the sense input changes; `None` for not at all.
    """

    stopped: bool = False
    stop_turns_ns: int | None = None
    pulses_ns: deque[int] = field(default_factory=deque)
    period_ns: int = 0
    sense_s: float | None = None

    def pulse(self) -> int:
        """Take the next pulse: when it is."""
        when_ns = self.pulses_ns.popleft()
        if self.period_ns and not self.pulses_ns:
            self.pulses_ns.append(when_ns + self.period_ns)
        return when_ns
