"""Which rods the edges of drops are: found out once of each, by whichever process comes first."""

from __future__ import annotations

from collections.abc import MutableMapping
from typing import TYPE_CHECKING

from rig.cache.entry import CacheEntry
from rig.records import Drop

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rig.analysis.identified import Identified
    from rig.protocol.protocol import Protocol


class KnownDrops(MutableMapping[Drop, "Identified"]):
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
        self._held: dict[Drop, Identified] = {}

    def __getitem__(self, drop: Drop) -> Identified:
        if drop not in self._held:
            kept = self._entry(drop).find()
            if kept is None:
                raise KeyError(drop.run, drop.attempt)
            self._held[drop] = kept
        return self._held[drop]

    def __setitem__(self, drop: Drop, identified: Identified) -> None:
        self._held[drop] = identified
        self._entry(drop).keep(identified)

    def __delitem__(self, drop: Drop) -> None:
        del self._held[drop]

    def __iter__(self) -> Iterator[Drop]:
        return iter(self._held)

    def __len__(self) -> int:
        return len(self._held)

    def _entry(self, drop: Drop) -> CacheEntry:
        return CacheEntry("drop", self._content, drop, fresh=self._fresh)
