"""What changed from one snapshot of the gates to the next."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

ALL_GATES = 0xFFFF
_WRAP = 1 << 32
_HALF = _WRAP // 2


def edges(
    events: Iterable[tuple[int, int]], state: int, gates: int, fire_tick: int
) -> list[tuple[int, int, bool]]:
    """List the edges between snapshots.

    Parameters
    ----------
    events
        Tick (u32) and state of each snapshot, none missing.
    state
        Of the gates before the first one.
    gates
        Mask of the gates that count.
    fire_tick
        Tick of the release.

    Returns
    -------
    list of (int, int, bool)
        As `rig.records.Edge` has them; of one snapshot, by channel.
    """
    found: list[tuple[int, int, bool]] = []
    for tick, now in events:
        changed = (state ^ now) & gates
        state = now
        while changed:
            lowest = changed & -changed
            changed ^= lowest
            since = (tick - fire_tick + _HALF) % _WRAP - _HALF
            found.append((since, lowest.bit_length() - 1, now & lowest != 0))
    return found


def ticks_since(fire_tick: int, tick: int) -> int:
    """Ticks from the fire stamp; negative before it."""
    return (tick - fire_tick + _HALF) % _WRAP - _HALF
