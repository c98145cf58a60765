"""Recovery of drops from their stored rows and from the raw bytes."""

from dataclasses import replace
from itertools import groupby
from operator import itemgetter
from typing import NamedTuple

from rig.reasons import make_reason
from rig.records import Drop
from rig.recover.rows import Rows
from rig.session.drop_check import WHOLE, ByteReplay, Fate, check_drop
from rig.session.rows import drop_of, named_values


class RecoveredDrop(NamedTuple):
    """A drop with the result of its check and its further stored data."""

    drop: Drop
    fate: Fate
    host_ns: int | None = None
    provenance: str = "recovered"


def recover_drops(rows: Rows) -> list[RecoveredDrop]:
    """Return the best version of every drop, in the order of recording.

    The device's CRC-32 over a drop's events is in the bytes, not in the edges: where the two
    differ, a drop that the bytes give without a fault is the right one.
    """
    replay = ByteReplay()
    replay.feed(row[1:] for row in rows.in_order("bytes"))
    replayed = replay.drops()
    edges = {drop: [*own] for drop, own in groupby(rows.in_order("edge"), itemgetter(0))}
    drops: list[RecoveredDrop] = []
    for row in rows.in_order("drop"):
        values = named_values(row)
        stored = drop_of(row, edges.get(row[0], []))
        fate = check_drop(stored, replayed)
        best = _best(stored, replayed.get(stored.job), fate)
        drops.append(RecoveredDrop(best, fate, values["host_ns"], values["provenance"]))
    stored_jobs = {each.drop.job for each in drops}
    # Drops that were never stored are recovered only if complete.
    return drops + [
        RecoveredDrop(drop, Fate.RESTORED)
        for job, drop in sorted(replayed.items())
        if job not in stored_jobs and drop.certificate is not None and not drop.faults
    ]


def _best(stored: Drop, replayed: Drop | None, fate: Fate) -> Drop:
    if fate in WHOLE:
        return stored
    if replayed is not None and fate is Fate.RESTORED:
        return replayed
    torn = max((stored, replayed or stored), key=lambda drop: len(drop.edges))
    # An incomplete drop is void: its lost edges are not missed rods.
    return replace(torn, faults=(*torn.faults, make_reason("record_torn")))
