"""Puts one drop together from the messages about it, in whatever order they come."""

import zlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import fields
from typing import Any

import msgspec

from rig.boards import GATES
from rig.link import messages as wire
from rig.reasons import Reason, make_reason
from rig.records import Certificate, Drop, Edge

ALL_GATES = (1 << GATES) - 1
_CUT = {
    wire.PulseEnd.STOPPED: "pulse_stopped",
    wire.PulseEnd.ABORTED: "pulse_aborted",
    wire.PulseEnd.DEVICE: "pulse_cut",
}
_HALF = 1 << 31


class Assembly:
    """What is known about one drop so far.

    Parameters
    ----------
    label
        The drop's label.
    gates
        Mask of the gates that count (from ARM; the certificate repeats it).
    record_ms
        How long after FIRE it is recorded, as ARM said; 0 where that was not heard.

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

    def __init__(self, label: int, gates: int = ALL_GATES, record_ms: int = 0) -> None:
        self.label = label
        self.gates = gates
        self.record_ms = record_ms
        self.fire_tick: int | None = None
        self.certificate: wire.DropCertificate | None = None
        self.reset = False
        self.first_kept = 0
        self._events: dict[int, tuple[int, int]] = {}  # tick and state by number

    @property
    def begun(self) -> bool:
        """Whether anything of the drop itself was seen."""
        return bool(self._events) or self.fire_tick is not None or self.certificate is not None

    def add(self, frame: wire.EventsFrame) -> None:
        """Take events; what was there already is replaced, so a re-read repairs."""
        self._events.update(enumerate(wire.EVENT.iter_unpack(frame.events), frame.first))

    def missing(self, first: int = 0) -> list[int]:
        """List the numbers of events, from `first` on, that are not known.

        Returns
        -------
        list of int
            Empty while there is no certificate to say how many there are.
        """
        total = self.certificate.events if self.certificate else 0
        return sorted({*range(first, total)}.difference(self._events))

    def sound(self) -> bool:
        """Whether every event and the certificate are in and agree."""
        if self.certificate is None or self.missing():
            return False
        events = map(self._events.__getitem__, range(self.certificate.events))
        return zlib.crc32(wire.pack_events(events)) == self.certificate.crc32

    def forget_events(self, latest: int) -> None:
        """Drop the latest so many events, to read them again."""
        for number in sorted(self._events)[-latest:]:
            del self._events[number]

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
        seen = self.certificate
        fire_tick = seen.fire_tick if seen else self.fire_tick
        # A device arms only with its gates clear, so 0 stands in where no certificate came.
        initial = seen.initial_state if seen else 0
        return Drop(
            *wire.unpack_label(self.label),
            tick_hz=tick_hz,
            edges=self._edges(initial, fire_tick),
            fire_tick=fire_tick,
            initial_state=initial,
            certificate=_account(seen) if seen else None,
            faults=tuple(self._faults(tick_hz)),
        )

    def _edges(self, state: int, fire_tick: int | None) -> tuple[Edge, ...]:
        if fire_tick is None:
            return ()
        seen, known = self.certificate, self._events
        numbers = sorted(known.keys() & range(seen.events) if seen else known)
        # Behind a gap it is not known when the gates changed: no edge is better than a wrong one.
        before = [known.get(n - 1, known[n])[1] if n else state for n in numbers]
        events = map(known.__getitem__, numbers)
        return edges(events, before, (seen or self).gates, fire_tick)

    def _faults(self, tick_hz: int) -> Iterator[Reason]:
        if not tick_hz:
            yield make_reason("no_identity")
        if self.reset and not self.sound():
            yield make_reason("restarted")
        seen = self.certificate
        if seen is None:
            yield make_reason("no_certificate")
            return
        if missing := self.missing():
            code = "events_overwritten" if missing[0] < self.first_kept else "events_missing"
            yield make_reason(code, missing=len(missing), events=seen.events, first=missing[0])
        elif not self.sound():
            yield make_reason("crc_mismatch")
        if seen.overflows:
            yield make_reason("edges_lost", lost=seen.overflows)
        if isinstance(seen, wire.DropCertificate2) and seen.pulse_end in _CUT and tick_hz:
            yield make_reason(_CUT[seen.pulse_end], lasting_s=seen.pulse_ticks / tick_hz)


def _account(seen: wire.DropCertificate) -> Certificate:
    sense = ticks_since(seen.fire_tick, seen.sense_tick) if seen.sensed else None
    values: dict[str, Any] = {f.name: getattr(seen, f.name, None) for f in fields(Certificate)}
    return Certificate(**values | {"release_sense": sense})


def edges(
    events: Iterable[Sequence[int]], before: Iterable[int], gates: int, fire_tick: int
) -> tuple[Edge, ...]:
    """List the edges that events show, by event and channel.

    Parameters
    ----------
    events
        Tick (u32) and state of the gates.
    before
        State of the gates before each of them.
    gates
        Mask of the gates that count.
    fire_tick
        Tick of the release.
    """
    values = [
        (ticks_since(fire_tick, tick), channel, state >> channel & 1 == 1)
        for (tick, state), old in zip(events, before, strict=False)
        for channel in wire.channels_of((old ^ state) & gates)
    ]
    return msgspec.convert(values, tuple[Edge, ...])  # in a third of the time of one by one


def ticks_since(fire_tick: int, tick: int) -> int:
    """Ticks from the fire stamp; negative before it."""
    return (tick - fire_tick + _HALF) % (2 * _HALF) - _HALF
