"""Cache of the drops' own summaries, shared by all processes."""

from dataclasses import replace
from hashlib import sha256
from itertools import chain

import numpy as np

from rig.analysis.drop import DropSummary
from rig.cache.entry import find, keep
from rig.protocol.protocol import Protocol
from rig.records import Drop


class KnownDrops:
    """The `summaries` of `rig.analysis.session.analyze`, stored on disk.

    Parameters
    ----------
    protocol
        Protocol of all drops, with the beams of its timer.
    blind
        Whether not to store any summary.
    fresh
        Whether to ignore stored summaries.
    """

    def __init__(self, protocol: Protocol, *, blind: bool = False, fresh: bool = False) -> None:
        self._scene = None if blind else (protocol.text, protocol.gates.mask)
        self._fresh = fresh

    def get(self, drop: Drop) -> DropSummary | None:
        """Return the summary of a drop; `None` if there is none."""
        stored = find(DropSummary, *self._content(drop), fresh=self._fresh)
        return stored and stored.whole()

    def __setitem__(self, drop: Drop, summary: DropSummary) -> None:
        keep(summary, *self._content(drop))

    def _content(self, drop: Drop) -> tuple[object, str]:
        digest = sha256(f"{edges_digest(drop)} {replace(drop, edges=())}".encode()).hexdigest()
        return self._scene, digest


def edges_digest(drop: Drop) -> str:
    """Return the SHA-256 of a drop's edges, independent of its run."""
    edges = np.fromiter(chain.from_iterable(drop.edges), np.int64, 3 * len(drop.edges))
    return sha256(edges.tobytes() + b"%d" % drop.tick_hz).hexdigest()
