"""Puts one drop together from the messages about it, in whatever order they come."""

from __future__ import annotations

import zlib
from typing import TYPE_CHECKING

from rig.link.messages import EVENTS_PER_FRAME, unpack_label
from rig.records import Certificate, Drop, Edge

if TYPE_CHECKING:
    from rig.link.messages import DropCertificate, EventsFrame
    from rig.link.wiretypes import Event

_WRAP = 1 << 32


class Assembly:
    """What is known about one drop so far.

    Parameters
    ----------
    label
        The drop's label.

    Attributes
    ----------
    gates
        Mask of the gates that count (from ARM; the certificate repeats it).
    fire_tick
        From FIRED (the certificate repeats it), or `None`.
    certificate
        The device's account, once it is in.
    reset
        Whether the device restarted while the drop was open.
    first_kept
        Number of the oldest event that can still be read, as far as the device has said so.
    """

    def __init__(self, label: int) -> None:
        self.label = label
        self.gates = 0xFFFF
        self.fire_tick: int | None = None
        self.certificate: DropCertificate | None = None
        self.reset = False
        self.first_kept = 0
        self._events: dict[int, Event] = {}

    @property
    def begun(self) -> bool:
        """Whether anything of the drop itself was seen."""
        return bool(self._events) or self.fire_tick is not None or self.certificate is not None

    def add(self, frame: EventsFrame) -> None:
        """Take events; what was there already is replaced, so a re-read repairs."""
        self._events.update(enumerate(frame.events, start=frame.first))

    def missing(
        self, at_most: int = EVENTS_PER_FRAME, *, readable: bool = False
    ) -> list[tuple[int, int]]:
        """List the stretches of events that are not known.

        Parameters
        ----------
        at_most
            Longest stretch to list as one.
        readable
            Whether to leave out what the device does not keep any more.

        Returns
        -------
        list of (first, count)
            Empty when nothing is missing, and while there is no certificate to say how many.
        """
        total = self.certificate.events if self.certificate else 0
        stretches: list[tuple[int, int]] = []
        for index in range(self.first_kept if readable else 0, total):
            if index in self._events:
                continue
            if stretches:
                first, count = stretches[-1]
                if first + count == index and count < at_most:
                    stretches[-1] = (first, count + 1)
                    continue
            stretches.append((index, 1))
        return stretches

    def sound(self) -> bool:
        """Whether every event and the certificate are in and agree."""
        certificate = self.certificate
        return certificate is not None and not self.missing() and self._crc() == certificate.crc32

    def forget_events(self, latest: int | None = None) -> None:
        """Drop the events, to read them again; only the latest so many, when said."""
        first = max(0, len(self._events) - latest) if latest is not None else 0
        self._events = {index: e for index, e in self._events.items() if index < first}

    def drop(self, tick_hz: int) -> Drop:
        """Make the raw record of what is known now.

        Parameters
        ----------
        tick_hz
            Nominal tick rate.

        Returns
        -------
        Drop
            With a fault for everything that is not as it should be.
        """
        run, attempt = unpack_label(self.label)
        seen = self.certificate
        fire_tick = seen.fire_tick if seen else self.fire_tick
        # A device arms only with its gates clear, so 0 stands in where no certificate came.
        initial = seen.initial_state if seen else 0
        return Drop(
            run=run,
            attempt=attempt,
            tick_hz=tick_hz,
            edges=self._edges(initial, fire_tick),
            fire_tick=fire_tick,
            initial_state=initial,
            certificate=_account(seen) if seen else None,
            faults=self._faults(tick_hz),
        )

    def _crc(self) -> int:
        return zlib.crc32(
            b"".join(
                event.tick.to_bytes(4, "little") + event.state.to_bytes(2, "little")
                for _, event in self._in_order()
            )
        )

    def _in_order(self) -> list[tuple[int, Event]]:
        """Events by index, without any beyond the certificate's count."""
        total = self.certificate.events if self.certificate else _WRAP
        return sorted(item for item in self._events.items() if item[0] < total)

    def _edges(self, initial: int, fire_tick: int | None) -> tuple[Edge, ...]:
        if fire_tick is None:
            return ()
        gates = self.certificate.gates if self.certificate else self.gates
        edges: list[Edge] = []
        state, expected = initial & gates, 0
        for index, event in self._in_order():
            now = event.state & gates
            # Behind a gap it is not known when the gates changed: no edge is better than a
            # wrong one.
            changed = state ^ now if index == expected else 0
            tick = _since(fire_tick, event.tick)
            while changed:
                lowest = changed & -changed
                edges.append(Edge(tick, lowest.bit_length() - 1, bool(now & lowest)))
                changed ^= lowest
            state, expected = now, index + 1
        return tuple(edges)

    def _faults(self, tick_hz: int) -> tuple[str, ...]:
        faults = []
        if not tick_hz:
            faults.append("the device never identified itself: its tick rate is unknown")
        if self.reset and not self.sound():
            faults.append("the device restarted before the drop was read")
        seen = self.certificate
        if seen is None:
            faults.append("no certificate: the device did not close the record")
            return tuple(faults)
        gaps = self.missing(at_most=_WRAP)
        if gaps:
            first = gaps[0][0]
            count = sum(count for _, count in gaps)
            how = "no longer kept by the device" if first < self.first_kept else "missing"
            faults.append(f"{count} of {seen.events} events {how}, from number {first}")
        elif self._crc() != seen.crc32:
            faults.append("the events do not match the certificate's CRC-32")
        if seen.overflows:
            faults.append(f"{seen.overflows} events lost: the device's memory was full")
        return tuple(faults)


def _account(seen: DropCertificate) -> Certificate:
    sense = _since(seen.fire_tick, seen.sense_tick) if seen.sensed else None
    return Certificate(seen.events, seen.crc32, seen.overflows, seen.glitches, seen.late, sense)


def _since(fire_tick: int, tick: int) -> int:
    """Ticks from the fire stamp; negative before it."""
    return (tick - fire_tick + _WRAP // 2) % _WRAP - _WRAP // 2
