"""Replay of a recorded drop: drop, time and speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from rig.records import Drop, Edge
from rig.tui.indicators import Indicators

SLOWEST, FASTEST = 2.0**-10, 4.0
_STEP_S = 0.01
_AFTER_S = 0.05


@dataclass(frozen=True, slots=True)
class Player:
    """State of a replay.

    Attributes
    ----------
    at
        Number of the drop, in order of recording.
    time_s
        Time since the release fired, s.
    speed
        Replayed time in units of real time.
    """

    at: int = 0
    time_s: float = 0.0
    speed: float = 2.0**-4
    playing: bool = False

    def change_speed(self, factor: float) -> Player:
        """Return the replay with its speed multiplied by a factor, within limits."""
        return replace(self, speed=min(FASTEST, max(SLOWEST, self.speed * factor)))

    def step_time(self, steps: int, end_s: float) -> Player:
        """Return the replay paused, some steps back or forward."""
        return replace(self, time_s=self._within(steps * _STEP_S, end_s), playing=False)

    def other(self, by: int, count: int) -> Player:
        """Return the replay of another drop, from its beginning."""
        return replace(self, at=(self.at + by) % count, time_s=0.0)

    def toggle_play(self, end_s: float) -> Player:
        """Return the replay started or paused; from the beginning if it is at the end."""
        time_s = 0.0 if self.time_s == end_s else self.time_s
        return replace(self, playing=not self.playing, time_s=time_s)

    def advance(self, seconds: float, end_s: float) -> Player:
        """Return the replay advanced by real time; it stops at the end."""
        time_s = self._within(seconds * self.speed, end_s)
        return replace(self, time_s=time_s, playing=time_s != end_s) if self.playing else self

    def _within(self, seconds: float, end_s: float) -> float:
        return min(end_s, max(0.0, self.time_s + seconds))


def end_of(drop: Drop, hz: float) -> float:
    """Return the end time of a drop's replay, s."""
    return (drop.edges[-1].tick / hz if drop.edges else 0.0) + _AFTER_S


def until(edges: Sequence[Edge], hz: float, time_s: float) -> Sequence[Edge]:
    """Return the edges of a drop up to a time."""
    return [edge for edge in edges if edge.tick <= time_s * hz]


def indicators_at(channels: tuple[int, ...], drop: Drop, seen: Sequence[Edge]) -> Indicators:
    """Return the state of the gates after these edges."""
    mask = drop.initial_state
    for edge in seen:
        mask = mask | 1 << edge.channel if edge.blocked else mask & ~(1 << edge.channel)
    indicators = Indicators.of(channels).seen(mask, 0.0)
    return indicators.count_edges(tuple(edge.channel for edge in seen), float("-inf"))
