"""The measurands as functions of the fitted unknowns."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from rig.analysis.departures import STRETCHES, lags, lever, slack
from rig.analysis.drop_model import DropModel
from rig.analysis.dual import Dual
from rig.analysis.trajectory import Trajectory
from rig.arrays import Array

_STEP = 1e-3
"""Way over which a rod's gain on its chain is taken, m: strings act over a hundred times it."""


def measurands(model: DropModel, x: Array) -> dict[str, Dual]:
    """Return each measurand of the scene with its derivatives, by JSON name."""
    drop = AdjustedDrop(model, x)
    values = ((name, compute(drop)) for name, compute in COMPUTED.items())
    return {name: value for name, value in values if value is not None}


class Arrival(NamedTuple):
    """Arrival of the top rod at a height above the contact level, m: speed, m/s, and time, s."""

    speed: Dual
    when: Dual
    above: Dual | float = 0.0


@dataclass(frozen=True)
class AdjustedDrop:
    """A drop at given unknowns: quantities from which measurands and curves are computed.

    Attributes
    ----------
    model, x
        The drop and its unknowns.
    """

    model: DropModel
    x: Array

    @property
    def strikes(self) -> bool:
        """Whether a chain strikes anything."""
        return "impact" in self.model.records

    @property
    def on_track(self) -> bool:
        """Whether an object slides down a track."""
        return self.model.protocol.track is not None

    @property
    def both(self) -> bool:
        """Whether a free chain falls beside the striking chain."""
        return self.strikes and "free" in self.model.records

    def linear(self, name: str, share: Array | float = 1.0) -> Dual:
        """Return a weighted sum of a block's members; zero if the scene has no such block.

        Parameters
        ----------
        share
            Weight of each member, shape ``(members,)`` or ``(n, members)``.
        """
        block, share = self.model.unknowns.blocks.get(name, slice(0)), np.atleast_1d(share)
        slopes = np.zeros((*share.shape[:-1], self.x.size))
        slopes[..., block] = share if block.stop else 0.0
        return Dual(slopes @ self.x, slopes)

    def _by_path(self, role: str, value: Array | float, slopes: Array) -> Dual:
        return Dual(value, slopes @ self.model.slopes[role].path)

    def _path(self, role: str) -> Trajectory:
        return self.model.trajectory(role, self.x)

    @cached_property
    def gravity(self) -> Dual:
        """Acceleration of a free fall, or down a track, m/s²."""
        return self.model.protocol.gravity.value + self.linear("gravity")

    def release(self, role: str) -> Dual:
        """Return the release time of a chain, s."""
        return self.linear(f"{role} release")

    def levels(self, role: str, times: Dual) -> Dual:
        """Return the height of a chain's reference point at `times`, m; shape ``(n,)``."""
        height, speed, slopes = self._path(role).sights(times.value)
        return self._by_path(role, height, slopes).along(times, -speed)

    def squares(self, role: str, levels: Dual) -> Dual:
        """Return the squared speed of a chain at some levels by its path; shape ``(n,)``."""
        squares, slopes, steeper = self._path(role).squares(levels.value)
        return self._by_path(role, squares, slopes).along(levels, -steeper)

    def top(self, role: str, levels: Dual) -> Dual:
        """Return the height of the top rod for levels of the reference point, m; shape ``(n,)``."""
        chain, protocol = self.model.records[role].chain.chain, self.model.protocol
        level = levels + chain.length + self.linear(f"{role} rods", np.eye(chain.rods)[-1])
        # A swinging chain turns as it falls, which lowers its top rod.
        slope = float(lever(chain)[-1]) / protocol.gravity.value
        level -= self.linear(f"{role} swing", slope) * (protocol.drop.value - levels)
        gain = self.gain(role, levels.value).value
        level -= self.ahead(role, levels.value).along(levels, -gain)
        if role == "free":
            return level
        last: Array = levels.value < self._path(role).height[chain.rods - 1]  # falls alone
        return level + self.linear("top") * last

    def ahead(self, role: str, levels: Array) -> Dual:
        """Return how far the top rod is ahead of its place in the chain at these levels, m."""
        record, drop = self.model.records[role], self.model.protocol.drop.value
        fall = record, drop, np.full(levels.shape, record.chain.chain.rods - 1), levels
        behind = slack(*fall)
        way = self.linear(f"{role} air lag", -lags(*fall)[:, None])
        way -= self.linear(f"{role} slack", behind) + self.linear(f"{role} usual slack", behind)
        if role == "free":
            return way
        modes = self.model.discrepancy.top(levels)
        return way + self.linear(STRETCHES[0], modes) + self.linear(STRETCHES[1], modes)

    def gain(self, role: str, levels: Array) -> Dual:
        """Return how much further the top rod is `ahead` for each metre that its chain falls."""
        before, after = (self.ahead(role, levels + way) for way in (0.5 * _STEP, -0.5 * _STEP))
        return (after - before) * (1.0 / _STEP)

    @property
    def late(self) -> Dual:
        """Gain of speed of the top rod by late pulls, m/s."""
        return self.linear("late", self.model.discrepancy.late_pull)

    @cached_property
    def arrival(self) -> Arrival:
        """Arrival of the top rod's middle at the contact level, with V.

        This is the path with first-order corrections.

        The top rod is ahead of its place by w and faster than its chain by w′: it arrives
        e = w/(V + w′) earlier, and slower by g·e. Late pulls act over the distance below the
        lowest beam. All are small, and second-order terms are left out.
        """
        path, level = self._path("impact"), -self.model.records["impact"].strikes[-1:]
        speed = self._by_path("impact", path.arrival, path.slopes.arrival)
        hit = self._by_path("impact", float(path.time[-1]), path.slopes.time[-1])
        fast = speed + self.gain("impact", level)[0] * speed
        early = self.ahead("impact", level)[0] / fast
        speed = fast - self.gravity * early
        later = 0.5 * self.model.discrepancy.late_way * self.late / (speed * speed)
        return Arrival(speed + self.late, hit - early - later)

    @cached_property
    def skew(self) -> Dual:
        """Release time of the free chain less that of the impact chain, s."""
        return self.release("free") - self.release("impact")

    @cached_property
    def strike(self) -> Arrival | None:
        """Strike of the top rod, a ballistic leg away from the contact level.

        `None` without impacts, or if the strike is higher than the speed at the level allows.
        """
        if not self.strikes:
            return None
        (speed, hit, _), contact = self.arrival, self.model.protocol.contact
        above = contact.strike.value + self.linear("contact") + self.linear("strike")
        kappa = Dual(self._path("impact").kappa, self.linear("drag").slopes)
        squared = speed * speed - 2.0 * above * (self.gravity - kappa * speed * speed)
        if squared.value <= 0.0:
            return None
        end = squared.root()
        return Arrival(end, hit - 2.0 * above / (speed + end), above)

    def apart(self, when: Dual) -> Dual:
        """Return the height of the free chain's top rod above the contact point at `when`, m."""
        moment = Dual(np.array([when.value]), when.slopes[None])
        return self.top("free", self.levels("free", moment))[0]


COMPUTED: dict[str, Callable[[AdjustedDrop], Dual | None]] = {
    # The free chain is read after the same time since its own release as the striking chain. No
    # model of its later fall is needed.
    "separation_m": lambda drop: drop.apart(drop.arrival.when + drop.skew) if drop.both else None,
    "separation_raw_m": lambda drop: drop.apart(drop.arrival.when) if drop.both else None,
    "separation_strike_m": lambda drop: (
        drop.apart(drop.strike.when + drop.skew) - drop.strike.above
        if drop.both and drop.strike
        else None
    ),
    "release_skew_s": lambda drop: drop.skew if drop.both else None,
    "speed_m_s": lambda drop: drop.arrival.speed if drop.strikes else None,
    "speed_strike_m_s": lambda drop: drop.strike.speed if drop.strike else None,
    "fall_time_s": lambda drop: (
        drop.arrival.when - drop.release("impact") if drop.strikes else None
    ),
    "gravity_m_s2": lambda drop: None if drop.strikes or drop.on_track else drop.gravity,
    "acceleration_m_s2": lambda drop: drop.gravity if drop.on_track else None,
}
"""Function for each row of `rig.measurands`; it returns `None` if the scene lacks the measurand."""
