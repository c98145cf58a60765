"""The virtual board's memory of one drop."""

from __future__ import annotations

import zlib
from typing import TYPE_CHECKING

from rig.link.messages import (
    EVENTS_PER_FRAME,
    DropCertificate2,
    Event,
    EventsFrame,
    PulseEnd,
    pack_events,
)

if TYPE_CHECKING:
    from rig.link.messages import Arm, Identity

_SUPPLY_MV = 5000
_MOST = 0xFFFF  # an event's number is a u16


class Recording:
    """Events of a drop, in as much memory as the board has.

    Parameters
    ----------
    order
        The ARM request.
    fire_tick
        When it was fired.
    identity
        How many events the board can keep, and what counts as late.

    Attributes
    ----------
    sent
        How many events were streamed already.
    aborted
        Whether ABORT came since: then the same label may be armed again.
    sense_tick
        When the release-sense input changed, or `None`.
    release, restarts
        For the certificate: ticks that the release was on and what ended it; restarts since
        IDENTIFY.
    """

    def __init__(self, order: Arm, fire_tick: int, identity: Identity) -> None:
        self.order = order
        self.sent = 0
        self.aborted = False
        self.sense_tick: int | None = None
        self._fire_tick = fire_tick
        self._identity = identity
        # All of them, for the certificate; a real board that streams keeps a running CRC.
        self._events: list[Event] = []
        self._overflows = 0
        self._glitches = 0
        self._late = 0
        self.release = (0, PulseEnd.ORDERED)
        self.restarts = 0

    def __len__(self) -> int:
        return len(self._events)

    @property
    def unsent(self) -> int:
        """Events not streamed yet."""
        return len(self._events) - self.sent

    @property
    def first_kept(self) -> int:
        """Number of the oldest event that can still be read."""
        streams, capacity = self._identity.streams, self._identity.capacity
        return max(0, len(self._events) - capacity) if streams else 0

    def store(self, tick: int, state: int) -> None:
        """Take one snapshot, or count it as lost when there is no place for it."""
        waiting = self.unsent if self._identity.streams else len(self._events)
        if waiting >= self._identity.capacity or len(self._events) >= _MOST:
            self._overflows = min(self._overflows + 1, 0xFFFF)
            return
        if self._events:
            self._late += (tick - self._events[-1].tick) % 2**32 < self._identity.late_ticks
        # All gates were clear, or FIRE had been refused.
        self._glitches += state == (self._events[-1].state if self._events else 0)
        self._events.append(Event(tick, state))

    def part(self, first: int, count: int) -> EventsFrame:
        """Give some events, at most a frame full."""
        events = self._events[first : first + min(count, EVENTS_PER_FRAME)]
        return EventsFrame(self.order.label, first, pack_events(events))

    def certificate(self) -> DropCertificate2:
        """Account for the drop."""
        return DropCertificate2(
            label=self.order.label,
            fire_tick=self._fire_tick,
            gates=self.order.gates,
            initial_state=0,
            events=len(self._events),
            crc32=zlib.crc32(pack_events(self._events)),
            overflows=self._overflows,
            glitches=self._glitches,
            late=self._late,
            sensed=int(self.sense_tick is not None),
            sense_tick=self.sense_tick or 0,
            pulse_ticks=self.release[0],
            pulse_end=self.release[1],
            restarts=self.restarts,
            supply_mv=_SUPPLY_MV,
            lowest_mv=_SUPPLY_MV,
        )
