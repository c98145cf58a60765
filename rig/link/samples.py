"""Clock samples as columns of integers: a night has a hundred thousand of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from rig.records import Ping

Samples: TypeAlias = "NDArray[np.int64]"
"""Shape (n, 3): `rig.records.Ping`'s host time before and after, ns, and tick."""
SEND, RECV, TICK = range(3)


def samples(pings: Iterable[Ping] | Samples) -> Samples:
    """Turn clock samples into columns; columns stay what they are."""
    rows = pings if isinstance(pings, np.ndarray) else list(pings)
    return np.asarray(rows, np.int64).reshape(-1, 3)


def middles_ns(given: Samples) -> NDArray[np.int64]:
    """Host time in the middle of each round trip."""
    middle: NDArray[np.int64] = (given[:, SEND] + given[:, RECV]) // 2
    return middle
