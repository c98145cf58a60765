"""Each drop twice: as the session stored it, and as its bytes give it again."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, cast

from rig.reasons import make_reason
from rig.records import Job
from rig.session.drop_check import ByteReplay, Fate, check_drop
from rig.session.rows import drop_of

if TYPE_CHECKING:
    from rig.records import Drop
    from rig.recover.rows import Rows


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
    replay = ByteReplay()
    replay.feed(cast("Any", row[1:]) for _, row in sorted(rows.bytes.items()))
    again = replay.drops()
    known = set()
    drops: list[Recovered] = []
    for number, row in sorted(rows.drop.items()):
        values: Any = row  # checked when the row was found
        edges = rows.edge.get(number, {})
        stored = drop_of(values, cast("Any", [edge for _, edge in sorted(edges.items())]))
        job = Job(stored.run, stored.attempt)
        fate = check_drop(stored, again, torn=len(edges) != max(edges, default=-1) + 1)
        drops.append(Recovered(_best(stored, again.get(job), fate), fate, values[12], values[13]))
        known.add(job)
    # What was never stored is only worth having whole.
    return drops + [
        Recovered(drop, Fate.RESTORED)
        for job, drop in sorted(again.items())
        if job not in known and drop.certificate is not None and not drop.faults
    ]


def _best(stored: Drop, replayed: Drop | None, fate: Fate) -> Drop:
    if fate.whole:
        return stored
    if replayed is not None and fate is Fate.RESTORED:
        return replayed
    longer = replayed is not None and len(replayed.edges) > len(stored.edges)
    return _partial(replayed if replayed is not None and longer else stored)


def _partial(drop: Drop) -> Drop:
    """Make a drop void that is not whole any more: its missing edges are no missed rods."""
    return replace(drop, faults=(*drop.faults, make_reason("record_torn")))
