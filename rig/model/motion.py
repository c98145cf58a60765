"""The whole fall: both chains against time."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from itertools import accumulate, pairwise
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
        self._times = [0.0, *(hit.time_s for hit in self.hits)]
        self._heights = [drop, *(-height for height in chain.heights)]
        self._speeds = [initial_speed, *(hit.speed_after for hit in self.hits)]
        # Not the difference of two speeds: it has no digits left where α is tiny.
        steps = (hit.speed_before * gain for hit, gain in zip(self.hits, gains, strict=True))
        self._gained = [0.0, *accumulate(steps)]
        # Nor the difference of two times: short legs late in a long fall would lose theirs.
        self._legs = [
            2.0 * (above - below) / (after + hit.speed_before) if above > below else 0.0
            for (above, below), after, hit in zip(
                pairwise(self._heights), self._speeds, self.hits, strict=False
            )
        ]
        grown = [gained * leg for gained, leg in zip(self._gained, self._legs, strict=False)]
        self._separations = [0.0, *accumulate(grown)]

    @property
    def end_s(self) -> float:
        """When the top rod strikes."""
        return self._times[-1]

    def at(self, time_s: float) -> Instant:
        """State at a time; the speed just before the top rod's impact at its very instant.

        Raises
        ------
        ValueError
            Outside the fall.
        """
        if not 0.0 <= time_s <= self.end_s:
            raise ValueError(f"{time_s} s is outside the fall, 0 to {self.end_s} s")
        leg = min(bisect_right(self._times, time_s), len(self.hits)) - 1
        since = self._legs[leg] if time_s == self.end_s else time_s - self._times[leg]
        speed = self._speeds[leg] + self.gravity * since
        fallen = (self._speeds[leg] + 0.5 * self.gravity * since) * since
        return Instant(
            time_s,
            self._heights[leg] - fallen,
            speed,
            self._separations[leg] + self._gained[leg] * since,
        )
