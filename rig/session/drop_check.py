"""Check of a stored drop against its raw bytes, or against the CRC of its certificate.

All readers of drops, for results or for recovery, use this check.
"""

import zlib
from collections.abc import Iterable, Mapping
from dataclasses import fields, replace
from enum import StrEnum
from itertools import groupby
from typing import Any

from rig.link.messages import TEST_RUN, pack_events
from rig.link.transcript import Incoming, Restart, Transcript
from rig.records import Certificate, ClockSample, Direction, Drop, Job, Pulse

_LATER = [field.name for field in fields(Certificate) if field.default is None]
"""Fields that certificates of older formats do not have."""


class Fate(StrEnum):
    """Result of the check of a drop, in the words shown to users."""

    CONFIRMED = "whole, and the bytes say the same"
    IMPORTED = "whole; it came from a file, so there are no bytes to compare"
    UNCONFIRMED = "whole, but its bytes are not"
    RESTORED = "put together again from its bytes"
    PARTIAL = "not whole: neither the record nor the bytes have all of it"


WHOLE = {Fate.CONFIRMED, Fate.IMPORTED, Fate.UNCONFIRMED}
"""Fates for which the stored record counts as the recorded one."""


class ByteReplay:
    """Records decoded from the bytes of a session, incrementally.

    Attributes
    ----------
    fed
        Number of chunks decoded.
    records
        All decoded records in order, without the messages themselves.
    """

    def __init__(self) -> None:
        self.fed = 0
        self.records: list[Drop | ClockSample | Pulse | Restart] = []
        self._transcript = Transcript()

    def feed(self, chunks: Iterable[tuple[int, Direction, bytes]]) -> None:
        """Decode the next chunks: host time, direction and bytes."""
        for host_ns, direction, data in chunks:
            self.fed += 1
            records = self._transcript.feed(direction, host_ns, data)
            self.records += [record for record in records if not isinstance(record, Incoming)]

    def acknowledged_drops(self) -> list[Drop]:
        """Return the drops that the host acknowledged, without test runs."""
        return [told for told in self.records if isinstance(told, Drop) and told.run != TEST_RUN]

    def drops(self) -> dict[Job, Drop]:
        """Return the latest version of every drop, as far as it was received, without test runs."""
        drops = [*self._transcript.unfinished_drops(), *self.acknowledged_drops()]
        return {drop.job: drop for drop in drops if drop.run != TEST_RUN}


def check_drop(stored: Drop, replayed: Mapping[Job, Drop]) -> Fate:
    """Compare a stored drop with its bytes or, if these are damaged, with its own certificate.

    Parameters
    ----------
    stored
        The drop from its rows.
    replayed
        Drops of `ByteReplay.drops`.
    """
    again = replayed.get(stored.job)
    if again is None:
        told = [(drop.certificate, drop.fire_tick) for drop in replayed.values()]
        moved = stored.certificate and (stored.certificate, stored.fire_tick) in told
        if moved or not _sound(stored):
            return Fate.PARTIAL  # the bytes may have it under another name
        return Fate.IMPORTED if stored.certificate is None else Fate.UNCONFIRMED
    if as_old_as(stored, again) == stored:
        return Fate.CONFIRMED
    if again.certificate is not None and again.tick_hz:
        holds = _account_holds(again, again.certificate)
        if holds or (holds is None and not again.faults):
            return Fate.RESTORED
    return Fate.UNCONFIRMED if _sound(stored) else Fate.PARTIAL


def as_old_as(stored: Drop, drop: Drop) -> Drop:
    """Return `drop` without certificate and fault data that the stored drop's format lacks."""
    if [fault.code for fault in stored.faults] == [fault.code for fault in drop.faults]:
        drop = replace(drop, faults=stored.faults)  # older formats keep sentences without values
    if stored.certificate is None or drop.certificate is None:
        return drop
    if any(getattr(stored.certificate, name) is not None for name in _LATER):
        return drop
    none: dict[str, Any] = dict.fromkeys(_LATER)
    return replace(drop, certificate=replace(drop.certificate, **none))


def _sound(drop: Drop) -> bool:
    """Whether a stored record is consistent; a record with faults is void anyway."""
    if drop.damage or drop.faults:
        return not drop.damage
    seen = drop.certificate
    return bool(drop.edges) if seen is None else _account_holds(drop, seen) is not False


def _account_holds(drop: Drop, seen: Certificate) -> bool | None:
    """Whether number and CRC of the events match the certificate.

    `None` if undecided: the events of pulses too short to be stored are unknown.
    """
    events = [(tick, [*edges]) for tick, edges in groupby(drop.edges, lambda edge: edge.tick)]
    if not len(events) <= seen.events <= len(drop.edges) + seen.glitches:
        return False
    if len(events) < seen.events or drop.fire_tick is None:
        return None
    state, snapshots = drop.initial_state, []
    for tick, edges in events:  # what `rig.link.assembly.edges` makes of them, undone
        for _, channel, blocked in edges:
            state = state | 1 << channel if blocked else state & ~(1 << channel)
        snapshots.append(((drop.fire_tick + tick) & 0xFFFF_FFFF, state))
    return zlib.crc32(pack_events(snapshots)) == seen.crc32
