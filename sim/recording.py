"""The virtual board's memory of one drop."""

from __future__ import annotations

import zlib

from rig.link.messages import EVENTS_PER_FRAME, Arm, DropCertificate, EventsFrame
from rig.link.wiretypes import Event

_LATE_BELOW = 100
"""Just after an overflow of the 16-bit timer a stamp can have waited for the overflow interrupt."""


class Recording:
    """Events of a drop, in as much memory as the board has.

    Parameters
    ----------
    order
        The ARM request.
    fire_tick
        When it was fired.
    capacity
        Events that fit.
    glitches
        Pulses too short to be stamped.

    Attributes
    ----------
    sent
        How many events were streamed already.
    aborted
        Whether ABORT came since: then the same label may be armed again.
    """

    def __init__(self, order: Arm, fire_tick: int, capacity: int, glitches: int) -> None:
        self.order = order
        self.sent = 0
        self.aborted = False
        self._fire_tick = fire_tick
        self._capacity = capacity
        self._events: list[Event] = []
        self._overflows = 0
        self._glitches = glitches
        self._late = 0

    def __len__(self) -> int:
        return len(self._events)

    @property
    def unsent(self) -> int:
        """Events not streamed yet."""
        return len(self._events) - self.sent

    def store(self, tick: int, state: int) -> None:
        """Take one snapshot, or count it as lost when the memory is full."""
        if len(self._events) >= self._capacity:
            self._overflows = min(self._overflows + 1, 0xFFFF)
            return
        self._events.append(Event(tick, state))
        self._late += (tick & 0xFFFF) < _LATE_BELOW

    def part(self, first: int, count: int) -> EventsFrame:
        """Give some events, at most a frame full."""
        count = min(count, EVENTS_PER_FRAME)
        return EventsFrame(self.order.label, first, tuple(self._events[first : first + count]))

    def certificate(self) -> DropCertificate:
        """Account for the drop."""
        packed = b"".join(
            tick.to_bytes(4, "little") + state.to_bytes(2, "little") for tick, state in self._events
        )
        return DropCertificate(
            label=self.order.label,
            fire_tick=self._fire_tick,
            gates=self.order.gates,
            initial_state=0,  # the gates that count were clear, or FIRE had been refused
            events=len(self._events),
            crc32=zlib.crc32(packed),
            overflows=self._overflows,
            glitches=min(self._glitches, 0xFFFF),
            late=self._late,
        )
