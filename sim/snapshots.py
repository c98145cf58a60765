"""What a pin-change interrupt makes of light and shadow: snapshots, some of them of glitches."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable

GLITCH_S = 2.7e-6
"""A shorter pulse is over before the interrupt looks at the port (measured, ATmega2560)."""


class Snapshot(NamedTuple):
    """Gate state after a change, `ticks` after the fire stamp."""

    ticks: int
    state: int


def take_snapshots(
    changes: Iterable[tuple[float, int, bool]], gates: int, hz: float
) -> list[Snapshot]:
    """Turn changes of single beams into snapshots of all gates.

    Parameters
    ----------
    changes
        Seconds after fire, channel, blocked; in order of time.
    gates
        Mask of the gates that are watched; all of them are clear before.
    hz
        The device's true tick rate.

    Returns
    -------
    list of Snapshot
        In order of time. A pulse too short to be seen leaves one with the state of the one before.
    """
    snapshots: list[Snapshot] = []
    state = 0
    for seconds, flipped in _looks(changes, gates):
        state ^= flipped
        ticks = round(seconds * hz)
        if snapshots and snapshots[-1].ticks == ticks:
            snapshots.pop()
        snapshots.append(Snapshot(ticks, state))
    return snapshots


def _looks(changes: Iterable[tuple[float, int, bool]], gates: int) -> list[tuple[float, int]]:
    """When the interrupt looks, and which gate differs then: none after a glitch."""
    looks: list[tuple[float, int]] = []
    last: dict[int, int] = {}  # index of each channel's last change that was seen
    state = 0
    for seconds, channel, blocked in changes:
        bit = 1 << channel
        if not gates & bit or bool(state & bit) == blocked:
            continue
        state ^= bit
        at = last.pop(channel, None)
        if at is not None and seconds - looks[at][0] < GLITCH_S:
            looks[at] = looks[at][0], 0
        else:
            last[channel] = len(looks)
            looks.append((seconds, bit))
    return looks
