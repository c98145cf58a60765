"""What a pin-change interrupt makes of light and shadow: snapshots, and missed glitches."""

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
    changes: Iterable[tuple[float, int, bool]], initial: int, gates: int, hz: float
) -> tuple[list[Snapshot], int]:
    """Turn changes of single beams into snapshots of all gates.

    Parameters
    ----------
    changes
        Seconds after fire, channel, blocked; in order of time.
    initial
        Gate mask before.
    gates
        Mask of the gates that are watched.
    hz
        The device's true tick rate.

    Returns
    -------
    list of Snapshot, int
        In order of time, and how many pulses were too short to be seen.
    """
    seen, glitches = _without_glitches(changes, initial, gates)
    snapshots: list[Snapshot] = []
    state = initial & gates
    for seconds, channel, blocked in seen:
        state = state | 1 << channel if blocked else state & ~(1 << channel)
        ticks = round(seconds * hz)
        if snapshots and snapshots[-1].ticks == ticks:
            snapshots.pop()
        snapshots.append(Snapshot(ticks, state))
    return snapshots, glitches


def _without_glitches(
    changes: Iterable[tuple[float, int, bool]], initial: int, gates: int
) -> tuple[list[tuple[float, int, bool]], int]:
    """Remove pulses shorter than `GLITCH_S`, and changes to the state a gate is in already."""
    kept: list[tuple[float, int, bool] | None] = []
    last: dict[int, int] = {}  # index of each channel's last kept change
    state = initial
    glitches = 0
    for seconds, channel, blocked in changes:
        if not gates >> channel & 1 or bool(state >> channel & 1) == blocked:
            continue
        state ^= 1 << channel
        at = last.pop(channel, None)
        previous = None if at is None else kept[at]
        if at is not None and previous is not None and seconds - previous[0] < GLITCH_S:
            kept[at] = None
            glitches += 1
        else:
            last[channel] = len(kept)
            kept.append((seconds, channel, blocked))
    return [change for change in kept if change is not None], glitches
