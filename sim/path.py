"""Where a falling chain is at any time: the way down, leg by leg."""

from __future__ import annotations

import math
from bisect import bisect_left
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rig.model.drag import drag_leg, fallen

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.model.fall import Hit


@dataclass(frozen=True, slots=True)
class Path:
    """Height of a chain's reference point against time.

    Attributes
    ----------
    release_s
        When it was let go.
    start
        Height before release, m.
    gravity
        m/s².
    hits
        Impacts, with times counted from release; empty in free fall.
    hit_heights
        Height of the reference point at each impact, falling.
    kappas
        The air takes κv² from the acceleration, 1/m: before each hit, and after the last one what
        it was before; 0 without air.
    """

    release_s: float
    start: float
    gravity: float
    hits: Sequence[Hit] = ()
    hit_heights: Sequence[float] = ()
    kappas: Sequence[float] = (0.0,)

    def time_at(self, height: float) -> float:
        """When the reference point comes down to `height`, s."""
        # hit_heights falls, so its negative rises and can be searched.
        done = bisect_left(self.hit_heights, -height, key=lambda z: -z)
        begun, top, speed, kappa = self._leg(done)
        distance = max(0.0, top - height)
        return self.release_s + begun + drag_leg(distance, speed, self.gravity, kappa)[1]

    def height_at(self, time_s: float) -> float:
        """Height of the reference point at a time, m."""
        since = time_s - self.release_s
        if since <= 0.0:
            return self.start
        done = bisect_left(self.hits, since, key=lambda hit: hit.time_s)
        begun, top, speed, kappa = self._leg(done)
        since -= begun
        if kappa:
            return top - fallen(since, self.gravity, kappa, speed)
        return top - (speed + 0.5 * self.gravity * since) * since

    def last_at(self, above: float) -> tuple[float, float]:
        """When, and how fast, what hits last is so far above its hit, had it fallen freely there.

        Returns
        -------
        late_s, speed
            After the hit, s, so that it is negative above; m/s.
        """
        speed = self.hits[-1].speed_before
        *_, kappa = self._leg(len(self.hits) - 1)
        # g − κv² falls by e^(−2κd) on the way down d.
        pull = self.gravity - kappa * speed**2
        rise = math.expm1(2.0 * kappa * above) / kappa if kappa else 2.0 * above
        passing = math.sqrt(max(0.0, speed**2 - pull * rise))
        start = passing if above > 0.0 else speed
        _, late = drag_leg(abs(above), start, self.gravity, kappa)
        return math.copysign(late, -above), passing

    def _leg(self, done: int) -> tuple[float, float, float, float]:
        """After so many hits: when since the release, from where, how fast, at what κ it falls."""
        kappa = self.kappas[min(done, len(self.kappas) - 1)]
        if not done:
            return 0.0, self.start, 0.0, kappa
        hit = self.hits[done - 1]
        return hit.time_s, self.hit_heights[done - 1], hit.speed_after, kappa
