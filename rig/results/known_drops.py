"""What drops say by themselves: found out once of each, by whichever process comes first."""

from __future__ import annotations

from dataclasses import replace
from hashlib import sha256
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.drop import DropSummary
from rig.cache.entry import CacheEntry

if TYPE_CHECKING:
    from rig.protocol.protocol import Protocol
    from rig.records import Drop


class KnownDrops:
    """The `known` of `rig.analysis.session.analyze`, kept beyond this process.

    Parameters
    ----------
    protocol
        Of all drops, with the beams that its timer had.
    blind
        Whether nothing may be kept but in memory.
    fresh
        Whether to forget what was kept.
    """

    def __init__(self, protocol: Protocol, *, blind: bool = False, fresh: bool = False) -> None:
        gates = () if protocol.gates is None else protocol.gates.gates
        self._content = None if blind else (protocol.text, [gate.channel for gate in gates])
        self._fresh = fresh
        self._held: dict[str, DropSummary] = {}

    def get(self, drop: Drop) -> DropSummary | None:
        """Return what is known of a drop; `None` for nothing."""
        digest = digest_of(drop)
        summary = self._held.get(digest)
        if summary is None and (stored := self._entry(digest).find()) is not None:
            summary = stored.whole()
        return summary

    def __setitem__(self, drop: Drop, summary: DropSummary) -> None:
        digest = digest_of(drop)
        if self._content is None:
            self._held[digest] = summary
        self._entry(digest).keep(summary)

    def _entry(self, digest: str) -> CacheEntry[DropSummary]:
        return CacheEntry(DropSummary, self._content, digest, fresh=self._fresh)


def digest_of(drop: Drop) -> str:
    """SHA-256 of everything that a drop's record says."""
    return sha256(f"{edges_digest(drop)} {replace(drop, edges=())}".encode()).hexdigest()


def edges_digest(drop: Drop) -> str:
    """SHA-256 of the edges of a drop, whichever run it was."""
    edges = np.fromiter(chain.from_iterable(drop.edges), np.int64, 3 * len(drop.edges))
    return sha256(edges.tobytes() + b"%d" % drop.tick_hz).hexdigest()
