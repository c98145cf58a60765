"""Puts one drop together from the messages about it, in whatever order they come."""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Iterator
from dataclasses import fields
from typing import Any

from rig.boards import GATES
from rig.link.messages import (
    EVENT,
    EVENTS_PER_FRAME,
    DropCertificate,
    DropCertificate2,
    EventsFrame,
    PulseEnd,
    unpack_label,
)
from rig.reasons import Reason, make_reason
from rig.records import Certificate, Drop, Edge

ALL_GATES = (1 << GATES) - 1
_WRAP = 1 << 32
_CUT = {
    PulseEnd.STOPPED: "pulse_stopped",
    PulseEnd.ABORTED: "pulse_aborted",
    PulseEnd.DEVICE: "pulse_cut",
}
_HALF = _WRAP // 2


class Assembly:
    """What is known about one drop so far.

    Parameters
    ----------
    label
        The drop's label.
    gates
        Mask of the gates that count (from ARM; the certificate repeats it).

    Attributes
    ----------
    fire_tick
        From FIRED (the certificate repeats it), or `None`.
    certificate
        The device's account, once it is in.
    reset
        Whether the device restarted while the drop was open.
    first_kept
        Number of the oldest event that can still be read, as far as the device has said so.
    """

    def __init__(self, label: int, gates: int = ALL_GATES) -> None:
        self.label = label
        self.gates = gates
        self.fire_tick: int | None = None
        self.certificate: DropCertificate | None = None
        self.reset = False
        self.first_kept = 0
        self._raw = bytearray()  # the events' records, each at its number's place
        self._mask = bytearray()  # 1 where there is one

    @property
    def begun(self) -> bool:
        """Whether anything of the drop itself was seen."""
        return 1 in self._mask or self.fire_tick is not None or self.certificate is not None

    def add(self, frame: EventsFrame) -> None:
        """Take events; what was there already is replaced, so a re-read repairs."""
        first, raw = frame.first, frame.events
        end = first + len(raw) // EVENT.size
        self._reserve(end)
        self._raw[first * EVENT.size : end * EVENT.size] = raw
        self._mask[first:end] = b"\1" * (end - first)

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
        self._reserve(total)
        return [
            (at, min(at_most, end - at))
            for first, end in self._stretches(0, self.first_kept if readable else 0, total)
            for at in range(first, end, at_most)
        ]

    def sound(self) -> bool:
        """Whether every event and the certificate are in and agree."""
        certificate = self.certificate
        return certificate is not None and not self.missing() and self._crc() == certificate.crc32

    def forget_events(self, latest: int | None = None) -> None:
        """Drop the events, to read them again; only the latest so many, when said."""
        first = max(0, self._mask.count(1) - latest) if latest is not None else 0
        del self._mask[first:], self._raw[first * EVENT.size :]

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
            faults=tuple(self._faults(tick_hz)),
        )

    @property
    def _end(self) -> int:
        """One more than the last number an event can have."""
        return self.certificate.events if self.certificate else len(self._mask)

    def _reserve(self, end: int) -> None:
        """Make room for the events before a number."""
        lacking = max(0, end - len(self._mask))
        self._mask += bytes(lacking)
        self._raw += bytes(lacking * EVENT.size)

    def _stretches(self, value: int, first: int, end: int) -> Iterator[tuple[int, int]]:
        """List from where to where events are there (1) or not (0)."""
        first = self._mask.find(value, first, end)
        while first >= 0:
            stop = self._mask.find(1 - value, first, end)
            yield first, end if stop < 0 else stop
            first = self._mask.find(value, stop, end) if stop >= 0 else -1

    def _crc(self) -> int:
        """CRC-32 over all events; none is missing."""
        return zlib.crc32(self._raw[: self._end * EVENT.size])

    def _edges(self, initial: int, fire_tick: int | None) -> tuple[Edge, ...]:
        if fire_tick is None:
            return ()
        gates = self.certificate.gates if self.certificate else self.gates
        rows: list[tuple[int, int, bool]] = []
        for first, end in self._stretches(1, 0, min(self._end, len(self._mask))):
            raw = self._raw[first * EVENT.size : end * EVENT.size]
            events, state = EVENT.iter_unpack(raw), initial
            if first:
                # Behind a gap it is not known when the gates changed: no edge is better than a
                # wrong one.
                _, state = next(events)
            rows += edges(events, state, gates, fire_tick)
        return tuple(map(Edge._make, rows))

    def _faults(self, tick_hz: int) -> Iterator[Reason]:
        if not tick_hz:
            yield make_reason("no_identity")
        if self.reset and not self.sound():
            yield make_reason("restarted")
        seen = self.certificate
        if seen is None:
            yield make_reason("no_certificate")
            return
        gaps = self.missing(at_most=_WRAP)
        if gaps:
            first = gaps[0][0]
            code = "events_overwritten" if first < self.first_kept else "events_missing"
            missing = sum(count for _, count in gaps)
            yield make_reason(code, missing=missing, events=seen.events, first=first)
        elif self._crc() != seen.crc32:
            yield make_reason("crc_mismatch")
        if seen.overflows:
            yield make_reason("edges_lost", lost=seen.overflows)
        if isinstance(seen, DropCertificate2) and seen.pulse_end in _CUT and tick_hz:
            yield make_reason(_CUT[seen.pulse_end], lasting_s=seen.pulse_ticks / tick_hz)


def _account(seen: DropCertificate) -> Certificate:
    sense = ticks_since(seen.fire_tick, seen.sense_tick) if seen.sensed else None
    values: dict[str, Any] = {
        field.name: getattr(seen, field.name, None) for field in fields(Certificate)
    }
    return Certificate(**values | {"release_sense": sense})


def edges(
    events: Iterable[tuple[int, int]], state: int, gates: int, fire_tick: int
) -> list[tuple[int, int, bool]]:
    """List the edges between snapshots.

    Parameters
    ----------
    events
        Tick (u32) and state of each snapshot, none missing.
    state
        Of the gates before the first one.
    gates
        Mask of the gates that count.
    fire_tick
        Tick of the release.

    Returns
    -------
    list of (int, int, bool)
        As `rig.records.Edge` has them; of one snapshot, by channel.
    """
    rows: list[tuple[int, int, bool]] = []
    for tick, gates_state in events:
        changed = (state ^ gates_state) & gates
        state, since = gates_state, ticks_since(fire_tick, tick)
        while changed:
            lowest = changed & -changed
            changed ^= lowest
            rows.append((since, lowest.bit_length() - 1, state & lowest != 0))
    return rows


def ticks_since(fire_tick: int, tick: int) -> int:
    """Ticks from the fire stamp; negative before it."""
    return (tick - fire_tick + _HALF) % _WRAP - _HALF
