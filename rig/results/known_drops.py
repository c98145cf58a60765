"""Which rods the edges of drops are: found out once of each, by whichever process comes first."""

from __future__ import annotations

from dataclasses import replace
from hashlib import sha256
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.identified import Identified
from rig.cache.entry import CacheEntry

if TYPE_CHECKING:
    from rig.protocol.protocol import Protocol
    from rig.records import Drop


class KnownDrops:
    """The `known` of `rig.analysis.drop.fit_drop`, kept beyond this process.

    Parameters
    ----------
    protocol
        Of all drops, with the beams that its timer had.
    blind
        Whether nothing may be kept.
    fresh
        Whether to forget what was kept.
    """

    def __init__(self, protocol: Protocol, *, blind: bool = False, fresh: bool = False) -> None:
        gates = () if protocol.gates is None else protocol.gates.gates
        self._content = None if blind else (protocol.text, [gate.channel for gate in gates])
        self._fresh = fresh
        self._held: dict[str, Identified] = {}
        self._last: tuple[Drop | None, str] = (None, "")

    def get(self, drop: Drop) -> Identified | None:
        """Return what is known of a drop; `None` for nothing."""
        digest = self._digest(drop)
        identified = self._held.get(digest) or self._entry(digest).find()
        if identified is not None:
            self._held[digest] = identified
        return identified

    def __setitem__(self, drop: Drop, identified: Identified) -> None:
        digest = self._digest(drop)
        self._held[digest] = identified
        self._entry(digest).keep(identified)

    def _entry(self, digest: str) -> CacheEntry[Identified]:
        return CacheEntry(Identified, self._content, digest, fresh=self._fresh)

    def _digest(self, drop: Drop) -> str:
        """SHA-256 of everything that a drop's record says."""
        if self._last[0] is not drop:
            head = repr(replace(drop, edges=())).encode()
            edges = np.fromiter(chain.from_iterable(drop.edges), np.int64, 3 * len(drop.edges))
            self._last = drop, sha256(head + edges.tobytes()).hexdigest()
        return self._last[1]
