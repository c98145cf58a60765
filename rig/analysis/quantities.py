"""The measurands, as functions of the adjusted unknowns, and the lines of their budget."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.analysis.air import lags, slack
from rig.analysis.discrepancy import STRETCHES
from rig.analysis.dual import Dual
from rig.analysis.swing import lever
from rig.protocol.protocol import GUESSED

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from rig.analysis.drop_model import DropModel
    from rig.analysis.trajectory import Trajectory
    from rig.arrays import Array


class BudgetLine(NamedTuple):
    """What is known of a line of the uncertainty budget.

    Attributes
    ----------
    common
        Whether it is the same in every run, so that averaging does not reduce it.
    guessed
        Whether nobody has measured its size, unless a joint fit finds it.
    scale
        The component that a joint fit finds, whose degrees of freedom the line has.
    known
        What could be measured better, with the protocol's key; empty where nothing can.
    """

    common: bool = False
    guessed: bool = False
    scale: str = ""
    known: str = ""


BUDGET = {
    "edges": BudgetLine(scale="jitter"),
    "clock": BudgetLine(common=True, known="the clock's rate"),
    "gravity": BudgetLine(common=True, known="gravity (`gravity`)"),
    "air": BudgetLine(common=True, known="the air's drag (`drag`)"),
    "drop height": BudgetLine(common=True, known="the drop height (`drop`)"),
    "datum": BudgetLine(common=True, known="the zero of each post (`datum_uncertainty`)"),
    "beam heights": BudgetLine(
        common=True, scale="gates", known="the heights of the beams (`height_uncertainty`)"
    ),
    "side": BudgetLine(
        common=True, guessed=True, known="how much higher one side hangs (`priors: side`)"
    ),
    "beam offsets": BudgetLine(
        common=True, guessed=True, scale="beam", known="the aim of the beams (`beam_offset`)"
    ),
    "spacing": BudgetLine(common=True, scale="rods", known="the spacing (`position_uncertainty`)"),
    "width": BudgetLine(common=True, known="the width (`width_uncertainty`)"),
    "start height": BudgetLine(guessed=True, scale="hang"),
    "swing": BudgetLine(guessed=True, scale="swing"),
    "single impulses": BudgetLine(guessed=True, scale="impulse"),
    "top rod": BudgetLine(guessed=True, scale="departure"),
    "stretch": BudgetLine(common=True, guessed=True, scale="stretch"),
    "late pull": BudgetLine(guessed=True, scale="bounce"),
    "contact": BudgetLine(guessed=True),
}
COMMON = tuple(name for name, line in BUDGET.items() if line.common)


def measurands(model: DropModel, x: Array) -> dict[str, Dual]:
    """Return each measurand of the scene."""
    drop = Adjusted(model, x)
    values = ((name, compute(drop)) for name, compute in COMPUTED.items())
    return {name: value for name, value in values if value is not None}


def effective_degrees(u: float, budget: Mapping[str, float], degrees: Mapping[str, float]) -> float:
    """Effective degrees of freedom by Welch and Satterthwaite (GUM G.4); at least 1.

    Parameters
    ----------
    budget
        Lines whose squares add up to that of `u`.
    degrees
        Degrees of freedom of lines; those of guessed lines are `GUESSED`, others infinite.
    """
    share = sum(
        (line / u) ** 4 / degrees.get(name, GUESSED)
        for name, line in budget.items()
        if name in degrees or BUDGET[name].guessed
    )
    return max(1.0, 1.0 / share) if share > 0.0 else math.inf


class _Strike(NamedTuple):
    """How far above the contact level the top rod strikes, when, and how fast it is."""

    above: Dual
    when: Dual
    speed: Dual


@dataclass(frozen=True)
class Adjusted:
    """A drop with its unknowns, and what measurands and curves are made of.

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
    def both(self) -> bool:
        """Whether a free chain falls beside it."""
        return self.strikes and "free" in self.model.records

    def linear(self, name: str, share: Array | float = 1.0) -> Dual:
        """Return a sum of a block's members, nothing where the scene has none.

        Parameters
        ----------
        share
            Of each, shape ``(members,)`` or ``(n, members)``.
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
        """The acceleration of a fall, or down a track."""
        return self.model.protocol.gravity.value + self.linear("gravity")

    def release(self, role: str) -> Dual:
        """When a chain was let go."""
        return self.linear(f"{role} release") + self.model.guesses[role].release

    def levels(self, role: str, times: Dual) -> Dual:
        """Where a chain's reference point is at some moments, shape ``(n,)``."""
        height, speed, slopes = self._path(role).sights(times.value)
        return self._by_path(role, height, slopes) - Dual(0.0 * speed, times.slopes) * speed

    def squares(self, role: str, levels: Dual) -> Dual:
        """Square of a chain's speed by the equations at some levels, shape ``(n,)``."""
        squares, slopes, steeper = self._path(role).squares(levels.value)
        return self._by_path(role, squares, slopes) - Dual(0.0 * squares, levels.slopes) * steeper

    def top(self, role: str, levels: Dual) -> Dual:
        """Where its top rod is, its reference point being at some levels, shape ``(n,)``."""
        chain, protocol = self.model.records[role].chain.chain, self.model.protocol
        level = levels + chain.length + self.linear(f"{role} rods", np.eye(chain.rods)[-1])
        # A chain that turned is lower at its top, the more the further it fell.
        slope = float(lever(chain)[-1]) / protocol.gravity.value
        level -= self.linear(f"{role} swing", slope) * (protocol.drop.value - levels)
        highest = np.full(levels.value.shape, chain.rods - 1)
        fall = self.model.records[role], protocol.drop.value, highest, levels.value
        level += self.linear(f"{role} air lag", lags(*fall))
        if role == "free":
            return level + self.linear("free slack", slack(*fall))
        last: Array = levels.value < self._path(role).height[chain.rods - 1]  # of all that fall
        return level + self.linear("top") * last - self.stretched(levels.value)[0]

    def stretched(self, levels: Array) -> tuple[Dual, Dual]:
        """How far ahead strings have pulled the top rod, and how much faster it is for that."""
        modes = self.model.discrepancy.top(levels)
        ahead, faster = (
            self.linear(STRETCHES[0], part) + self.linear(STRETCHES[1], part) for part in modes
        )
        return ahead, faster

    @property
    def late(self) -> Dual:
        """How much faster a late last pull makes the top rod by the contact level."""
        return self.linear("late", self.model.discrepancy.late_pull)

    @property
    def speed(self) -> Dual:
        """V as the top rod passes the contact level."""
        return self._arrival[0]

    @property
    def hit(self) -> Dual:
        """When that is."""
        return self._arrival[1]

    @cached_property
    def _arrival(self) -> tuple[Dual, Dual]:
        """V and its moment, by the equations' path, and by what strings did besides.

        The stretch has brought the top rod w ahead, at its rate w′: it arrives e = w/(V + w′)
        earlier, and slower by what it gains in that time. A late pull acts over the way below the
        lowest beam. Both are small, and what is of second order in them is left out.
        """
        path = self._path("impact")
        speed = self._by_path("impact", path.arrival, path.slopes.arrival)
        hit = self._by_path("impact", float(path.time[-1]), path.slopes.time[-1])
        ahead, faster = self.stretched(-self.model.records["impact"].strikes[-1:])
        fast = speed + faster[0]
        early = ahead[0] / fast
        speed = fast - self.gravity * early
        later = 0.5 * self.model.discrepancy.late_way * self.late / (speed * speed)
        return speed + self.late, hit - early - later

    @cached_property
    def skew(self) -> Dual:
        """The free chain's release less the impact chain's."""
        return self.release("free") - self.release("impact")

    @cached_property
    def strike(self) -> _Strike | None:
        """Go back from the level to where the top rod strikes, in one ballistic leg.

        `None` where nothing is struck, or so high that the chain never falls from there to the
        level.
        """
        if not self.strikes:
            return None
        speed, contact = self.speed, self.model.protocol.contact
        above = contact.strike.value + self.linear("contact") + self.linear("strike")
        kappa = Dual(self._path("impact").kappa, self.linear("drag").slopes)
        squared = speed * speed - 2.0 * above * (self.gravity - kappa * speed * speed)
        if squared.value <= 0.0:
            return None
        end = squared.root()
        return _Strike(above, self.hit - 2.0 * above / (speed + end), end)

    def apart(self, when: Dual) -> Dual:
        """Height of the free chain's top rod above the contact point at a moment."""
        moment = Dual(np.array([when.value]), when.slopes[None])
        return self.top("free", self.levels("free", moment))[0]


def _acceleration(drop: Adjusted, *, track: bool) -> Dual | None:
    """Return the acceleration of what strikes nothing, of a free fall or down a track."""
    down = drop.model.protocol.track is not None
    return drop.gravity if down == track and not drop.strikes else None


COMPUTED: dict[str, Callable[[Adjusted], Dual | None]] = {
    # The free chain is read off as long after its own release as the other one takes to strike: no
    # model of what it would have done comes in.
    "separation_m": lambda drop: drop.apart(drop.hit + drop.skew) if drop.both else None,
    "separation_raw_m": lambda drop: drop.apart(drop.hit) if drop.both else None,
    "separation_strike_m": lambda drop: (
        drop.apart(drop.strike.when + drop.skew) - drop.strike.above
        if drop.both and drop.strike
        else None
    ),
    "release_skew_s": lambda drop: drop.skew if drop.both else None,
    "speed_m_s": lambda drop: drop.speed if drop.strikes else None,
    "speed_strike_m_s": lambda drop: drop.strike.speed if drop.strike else None,
    "fall_time_s": lambda drop: drop.hit - drop.release("impact") if drop.strikes else None,
    "gravity_m_s2": partial(_acceleration, track=False),
    "acceleration_m_s2": partial(_acceleration, track=True),
}
"""How each row of `rig.measurands` follows from the unknowns; `None` where the scene has none."""
