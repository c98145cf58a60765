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
        Whether the emergency stop is open.
    pulses_ns
        When the reference will give a pulse, in order of time.
    sense_s
        How long after a release fires the sense input changes; `None` for not at all.
    """

    stopped: bool = False
    pulses_ns: deque[int] = field(default_factory=deque)
    sense_s: float | None = None
