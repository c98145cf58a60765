"""The whole fall: both chains against time."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rig.model.fall import Hit, hits

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.model.chain import Chain


@dataclass(frozen=True, slots=True)
class Instant:
    """Both chains at one moment.

    Attributes
    ----------
    height_m
        Bottom rod's middle of the striking chain above the contact point, had it not stopped
        there; the top rod is a chain length higher.
    speed_m_s
        Of the striking chain, downward.
    separation_m
        Δz: how far the free chain is above the striking one.
    """

    time_s: float
    height_m: float
    speed_m_s: float
    separation_m: float


class Motion:
    """A fall that can be asked at any time between release and the top rod's impact.

    Parameters
    ----------
    gains
        ΔV/V at each impact, as from `rig.model.fall.kicks`.
    drop, gravity, initial_speed
        As in `rig.model.fall.hits`.
    """

    def __init__(
        self,
        chain: Chain,
        gains: Sequence[float],
        drop: float,
        gravity: float,
        initial_speed: float = 0.0,
    ) -> None:
        self.chain = chain
        self.gravity = gravity
        self.hits: list[Hit] = hits(chain, gains, drop, gravity, initial_speed)
        # Where each leg begins, the speed gained before it, and its duration.
        self._legs: list[tuple[Instant, float, float]] = []
        start, gained = Instant(0.0, drop, initial_speed, 0.0), 0.0
        for hit, height, gain in zip(self.hits, chain.heights, gains, strict=True):
            # Not the difference of two times: short legs late in a long fall would lose theirs.
            distance = start.height_m + height
            duration = 2.0 * distance / (start.speed_m_s + hit.speed_before) if distance else 0.0
            self._legs.append((start, gained, duration))
            separation = start.separation_m + gained * duration
            start = Instant(hit.time_s, -height, hit.speed_after, separation)
            # Nor the difference of two speeds: it has no digits left where α is tiny.
            gained += hit.speed_before * gain

    @property
    def end_s(self) -> float:
        """When the top rod strikes."""
        return self.hits[-1].time_s

    def at(self, time_s: float) -> Instant:
        """State at a time; the speed just before the top rod's impact at its very instant.

        Raises
        ------
        ValueError
            Outside the fall.
        """
        if not 0.0 <= time_s <= self.end_s:
            raise ValueError(f"{time_s} s is outside the fall, 0 to {self.end_s} s")
        number = bisect_right(self._legs, time_s, key=lambda leg: leg[0].time_s) - 1
        start, gained, duration = self._legs[number]
        since = duration if time_s == self.end_s else time_s - start.time_s
        fallen = (start.speed_m_s + 0.5 * self.gravity * since) * since
        return Instant(
            time_s,
            start.height_m - fallen,
            start.speed_m_s + self.gravity * since,
            start.separation_m + gained * since,
        )
