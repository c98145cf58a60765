"""Each drop twice: as the session stored it, and as its bytes give it again."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING, Any, cast

from rig.link.transcript import Transcript
from rig.records import Certificate, Drop, Edge

if TYPE_CHECKING:
    from rig.link.transcript import Direction
    from rig.recover.rows import Row, Rows


class Fate(StrEnum):
    """What can be said of a drop, in the words that are shown."""

    CONFIRMED = "whole, and the bytes say the same"
    IMPORTED = "whole; it came from a file, so there are no bytes to compare"
    UNCONFIRMED = "whole, but its bytes are not"
    RESTORED = "put together again from its bytes"
    PARTIAL = "not whole: neither the record nor the bytes have all of it"


@dataclass(frozen=True, slots=True)
class Recovered:
    """A drop, what can be said of it, and what was stored about it besides."""

    drop: Drop
    fate: Fate
    host_ns: int | None = None
    provenance: str = "recovered"


def recover_drops(rows: Rows) -> list[Recovered]:
    """Give the best of every drop, in the order of recording.

    The device's CRC-32 over a drop's events is in the bytes, not in the edges: where the two
    differ, a drop that the bytes give without a fault is the right one.
    """
    again = _from_bytes(rows)
    found: list[Recovered] = []
    for number, row in sorted(rows.drop.items()):
        edges = rows.edge.get(number, {})
        drop = _stored(row, edges)
        host_ns, provenance = cast("tuple[int | None, str]", row[12:14])
        replayed = again.pop((drop.run, drop.attempt), None)
        better, fate = _judged(drop, replayed, torn=_torn(drop, edges))
        found.append(Recovered(better, fate, host_ns, provenance))
    # What was never stored is only worth having whole.
    found += [
        Recovered(drop, Fate.RESTORED)
        for (run, _), drop in sorted(again.items())
        if run and drop.certificate is not None and not drop.faults
    ]
    return found


def _judged(stored: Drop, replayed: Drop | None, *, torn: bool) -> tuple[Drop, Fate]:
    if replayed is None:
        if torn:
            return _partial(stored), Fate.PARTIAL
        return stored, Fate.IMPORTED if stored.certificate is None else Fate.UNCONFIRMED
    if replayed == stored:
        return stored, Fate.CONFIRMED
    if not replayed.faults and replayed.certificate is not None:
        return replayed, Fate.RESTORED
    if not torn:
        return stored, Fate.UNCONFIRMED
    return _partial(replayed if len(replayed.edges) > len(stored.edges) else stored), Fate.PARTIAL


def _partial(drop: Drop) -> Drop:
    """Make a drop void that is not whole any more: its missing edges are no missed rods."""
    return replace(drop, faults=(*drop.faults, "a part of the record was lost with its file"))


def _torn(drop: Drop, edges: dict[int, Row]) -> bool:
    """Whether edges are missing that must be there: they are numbered from 0."""
    return len(edges) != max(edges, default=-1) + 1 or (
        # A whole drop has as many edges as it has events, or more where gates changed together.
        drop.certificate is not None
        and not drop.faults
        and len(edges) < drop.certificate.events - drop.certificate.glitches
    )


def _from_bytes(rows: Rows) -> dict[tuple[int, int], Drop]:
    """Feed the bytes that are left through the parser again."""
    transcript = Transcript()
    drops: dict[tuple[int, int], Drop] = {}
    for _, row in sorted(rows.bytes.items()):
        host_ns, direction, data = cast("tuple[int, Direction, bytes]", row[1:])
        for record in transcript.feed(direction, host_ns, data):
            if isinstance(record, Drop):
                drops[record.run, record.attempt] = record
    for drop in transcript.unfinished():
        drops.setdefault((drop.run, drop.attempt), drop)
    return drops


def _stored(row: Row, edges: dict[int, Row]) -> Drop:
    # The shape was looked at when the row was found.
    values: Any = row
    _, run, attempt, tick_hz, fire_tick, initial, events, *counts = values[:11]
    sense = values[14:]  # a file of the first format has none
    return Drop(
        run=run,
        attempt=attempt,
        tick_hz=tick_hz,
        edges=tuple(
            Edge(tick, channel, bool(blocked))
            for _, (_, _, tick, channel, blocked) in sorted(cast("Any", edges).items())
        ),
        fire_tick=fire_tick,
        initial_state=initial,
        certificate=None if events is None else Certificate(events, *counts, *sense),
        faults=tuple(json.loads(values[11])),
    )
