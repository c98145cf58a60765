"""Any recorded drop again: which drop, which moment, and how fast time goes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from rig.tui.indicators import Indicators

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.records import Drop, Edge

SLOWEST, FASTEST = 2.0**-10, 4.0
_STEP_S = 0.01
_AFTER_S = 0.05


@dataclass(frozen=True, slots=True)
class Player:
    """The hand on the tape.

    Attributes
    ----------
    at
        Number of the drop, in order of recording.
    time_s
        Since the release fired.
    speed
        Seconds of the drop in a second.
    """

    at: int = 0
    time_s: float = 0.0
    speed: float = 2.0**-4
    playing: bool = False

    def turned(self, factor: float) -> Player:
        """Change the speed."""
        return replace(self, speed=min(FASTEST, max(SLOWEST, self.speed * factor)))

    def moved(self, steps: int, end_s: float) -> Player:
        """Go back or on a little and stand still."""
        return replace(self, time_s=self._within(steps * _STEP_S, end_s), playing=False)

    def other(self, by: int, count: int) -> Player:
        """Take another drop, from its beginning."""
        return replace(self, at=(self.at + by) % max(1, count), time_s=0.0)

    def started(self, end_s: float) -> Player:
        """Play, or stand still; at the end, from the beginning."""
        time_s = 0.0 if self.time_s == end_s else self.time_s
        return replace(self, playing=not self.playing, time_s=time_s)

    def ticked(self, seconds: float, end_s: float) -> Player:
        """Let time pass; it stops at the end."""
        time_s = self._within(seconds * self.speed, end_s)
        return replace(self, time_s=time_s, playing=time_s != end_s) if self.playing else self

    def _within(self, seconds: float, end_s: float) -> float:
        return min(end_s, max(0.0, self.time_s + seconds))


def end_of(drop: Drop, hz: float) -> float:
    """When a drop is over, s."""
    return (drop.edges[-1].tick / hz if drop.edges else 0.0) + _AFTER_S


def until(edges: Sequence[Edge], hz: float, time_s: float) -> Sequence[Edge]:
    """Edges of a drop up to a moment."""
    return [edge for edge in edges if edge.tick <= time_s * hz]


def indicators_at(channels: tuple[int, ...], drop: Drop, seen: Sequence[Edge]) -> Indicators:
    """Return the gates as they were after these edges."""
    mask = drop.initial_state
    for edge in seen:
        mask = mask | 1 << edge.channel if edge.blocked else mask & ~(1 << edge.channel)
    indicators = Indicators.of(channels).seen(mask, 0.0)
    return indicators.counted(tuple(edge.channel for edge in seen), float("-inf"))
