"""The measurands, as functions of the adjusted unknowns, with their uncertainty."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.analysis.adjust import uncertainty
from rig.analysis.deviation import deviation_alone
from rig.analysis.discrepancy import STRETCHES
from rig.analysis.result import Measured
from rig.analysis.swing import lever
from rig.protocol.protocol import GUESSED

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

    from rig.analysis.adjust import Estimate
    from rig.analysis.drop_model import DropModel

    Array = NDArray[np.float64]
    Value = tuple[float, Array]


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
COMMON = frozenset(name for name, line in BUDGET.items() if line.common)


def quantities(model: DropModel, estimate: Estimate) -> dict[str, Measured]:
    """Return everything the scene lets one measure, by its JSON name."""
    return {
        name: measured(model, estimate, value, gradient)
        for name, (value, gradient) in measurands(model, estimate.x).items()
    }


def measurands(model: DropModel, x: Array) -> dict[str, Value]:
    """Return the value of each measurand of the scene and its derivatives by all unknowns."""
    drop = Adjusted(model, x)
    found = ((name, compute(drop)) for name, compute in COMPUTED.items())
    return {name: value for name, value in found if value is not None}


def measured(model: DropModel, estimate: Estimate, value: float, gradient: Array) -> Measured:
    """Put a value and its uncertainty together, from its derivatives by all unknowns."""
    u, budget = uncertainty(estimate, gradient, model.unknowns.groups)
    degrees = effective_degrees(u, budget, {"edges": estimate.degrees})
    groups = model.unknowns.groups
    common = [block for name in COMMON & groups.keys() for block in groups[name]]
    deviation = deviation_alone(model, estimate, gradient * estimate.sd, common, degrees)
    return Measured(value, u, degrees, budget, deviation=deviation)


def effective_degrees(u: float, budget: Mapping[str, float], known: Mapping[str, float]) -> float:
    """Effective degrees of freedom by Welch and Satterthwaite (GUM G.4); at least 1.

    Parameters
    ----------
    budget
        Lines whose squares add up to that of `u`.
    known
        Degrees of freedom of lines; those of guessed lines are `GUESSED`, others infinite.
    """
    share = sum(
        (line / u) ** 4 / known.get(name, GUESSED)
        for name, line in budget.items()
        if name in known or BUDGET[name].guessed
    )
    return max(1.0, 1.0 / share) if share > 0.0 else math.inf


class _Strike(NamedTuple):
    """How far above the contact level the top rod strikes, when, and how fast it is."""

    above: Value
    when: Value
    speed: Value


@dataclass(frozen=True)
class Adjusted:
    """A drop with its unknowns, and what several measurands are made of.

    Attributes
    ----------
    model, x
        The drop and its unknowns.
    """

    model: DropModel
    x: Array

    @property
    def both(self) -> bool:
        """Whether a free chain falls beside one that strikes."""
        return {"impact", "free"} <= set(self.model.records)

    @property
    def speed(self) -> Value:
        """V as the top rod passes the contact level."""
        return self._arrival[0]

    @property
    def hit(self) -> Value:
        """When that is."""
        return self._arrival[1]

    @cached_property
    def _arrival(self) -> tuple[Value, Value]:
        """V and its moment, by the equations' path, and by what strings did besides.

        The stretch has brought the top rod w ahead, at its rate w′: it arrives e = w/(V + w′)
        earlier, and slower by what it gains in that time. A late pull acts over the way below the
        lowest beam. Both are small, and what is of second order in them is left out.
        """
        model, x, at = self.model, self.x, self.model.unknowns
        path = model.trajectory("impact", x)
        speed, d_speed = path.arrival, model.spread("impact", path.slopes.arrival)
        hit, d_hit = float(path.time[-1]), model.spread("impact", path.slopes.time[-1])
        if "stretch" in at:
            modes = model.discrepancy.top(-model.records["impact"].strikes[-1:])
            way, rate, sizes = modes.way[0], modes.rate[0], model.stretch(x)
            fast, d_fast = speed + float(rate @ sizes), d_speed.copy()
            early = float(way @ sizes) / fast
            d_early = np.zeros(x.size)
            for name in STRETCHES:
                d_fast[at[name]] += rate
                d_early[at[name]] = way / fast
            d_early -= early / fast * d_fast
            speed, d_speed = fast - path.gravity * early, d_fast - path.gravity * d_early
            d_speed[at["gravity"]] -= early
            hit, d_hit = hit - early, d_hit - d_early
        if "late" in at:
            pull, left = model.discrepancy.late_pull, model.discrepancy.late_way
            late = pull * float(x[at["late"]][0])
            d_late = np.zeros(x.size)
            d_late[at["late"]] = pull
            hit -= 0.5 * left * late / speed**2
            d_hit = d_hit - 0.5 * left * (d_late - 2.0 * late / speed * d_speed) / speed**2
            speed, d_speed = speed + late, d_speed + d_late
        return (speed, d_speed), (hit, d_hit)

    @cached_property
    def skew(self) -> Value:
        """The free chain's release less the impact chain's."""
        gradient = np.zeros(self.x.size)
        gradient[self.model.unknowns["free release"]] = 1.0
        gradient[self.model.unknowns["impact release"]] = -1.0
        begins = [float(self.model.trajectory(role, self.x).time[0]) for role in ("free", "impact")]
        return begins[0] - begins[1], gradient

    @cached_property
    def strike(self) -> _Strike | None:
        """Go back from the level to where the top rod strikes, in one ballistic leg.

        `None` where nothing is struck, or so high that the chain never falls from there to the
        level.
        """
        model, x, at = self.model, self.x, self.model.unknowns
        if "impact" not in model.records:
            return None
        path = model.trajectory("impact", x)
        contact = model.protocol.contact
        above = contact.strike.value + float(x[at["contact"]][0] + x[at["strike"]][0])
        d_above = np.zeros(x.size)
        d_above[at["contact"]] = d_above[at["strike"]] = 1.0
        (speed, d_speed), (hit, d_hit) = self.speed, self.hit
        pull = path.gravity - path.kappa * speed**2
        d_pull = -2.0 * path.kappa * speed * d_speed
        d_pull[at["gravity"]] += 1.0
        d_pull[at["drag"]] -= speed**2
        squared = speed**2 - 2.0 * pull * above
        if squared <= 0.0:
            return None
        end = math.sqrt(squared)
        d_end = (speed * d_speed - pull * d_above - above * d_pull) / end
        both, d_both = speed + end, d_speed + d_end
        when = hit - 2.0 * above / both
        d_when = d_hit - 2.0 * (d_above - above / both * d_both) / both
        return _Strike((above, d_above), (when, d_when), (end, d_end))

    def apart(self, when: float, d_when: Array) -> Value:
        """Height of the free chain's top rod above the contact point at a moment."""
        model, x, at = self.model, self.x, self.model.unknowns
        free = model.trajectory("free", x)
        top = model.records["free"].chain.chain.length + float(x[at["free rods"]][-1])
        height, speed = free.heights(np.array([when]))
        gradient = model.spread("free", free.derivatives(np.array([when])))[0]
        gradient -= float(speed[0]) * d_when
        turned = 0.0
        if "free swing" in at:
            # A chain that turned is lower at its top, the more the further it fell.
            chain, protocol = model.records["free"].chain.chain, model.protocol
            rate = float(x[at["free swing"]][0])
            slope = float(lever(chain)[-1]) / protocol.gravity.value
            fallen = protocol.drop.value - float(height[0])
            turned = rate * slope * fallen
            gradient *= 1.0 + rate * slope
            gradient[at["free swing"]] = -slope * fallen
        # The top rod is measured, not the reference point.
        gradient[at["free rods"].stop - 1] += 1.0
        return float(height[0]) + top - turned, gradient


def _gravity(drop: Adjusted) -> Value | None:
    """The acceleration of what falls and strikes nothing."""
    return None if drop.model.protocol.track is not None else _acceleration(drop)


def _track_acceleration(drop: Adjusted) -> Value | None:
    """The acceleration of what goes down a track."""
    return None if drop.model.protocol.track is None else _acceleration(drop)


def _acceleration(drop: Adjusted) -> Value | None:
    model, x = drop.model, drop.x
    if "impact" in model.records:
        return None
    gradient = np.zeros(x.size)
    gradient[model.unknowns["gravity"]] = 1.0
    return model.protocol.gravity.value + float(x[model.unknowns["gravity"]][0]), gradient


def _speed(drop: Adjusted) -> Value | None:
    """V just before the top rod strikes."""
    return drop.speed if "impact" in drop.model.records else None


def _fall_time(drop: Adjusted) -> Value | None:
    """How long it takes until the top rod strikes."""
    if "impact" not in drop.model.records:
        return None
    begin = float(drop.model.trajectory("impact", drop.x).time[0])
    duration = drop.hit[1].copy()
    duration[drop.model.unknowns["impact release"]] -= 1.0
    return drop.hit[0] - begin, duration


def _release_skew(drop: Adjusted) -> Value | None:
    """The free chain's release less the impact chain's."""
    return drop.skew if drop.both else None


def _separation_raw(drop: Adjusted) -> Value | None:
    """Δz at the instant of the top rod's strike."""
    return drop.apart(*drop.hit) if drop.both else None


def _separation(drop: Adjusted) -> Value | None:
    """Δz had both chains been let go together: the free one that much later, or earlier."""
    if not drop.both:
        return None
    # The free chain is read off where it was as long after its own release: no model of what it
    # would have done comes in.
    return drop.apart(drop.hit[0] + drop.skew[0], drop.hit[1] + drop.skew[1])


def _speed_strike(drop: Adjusted) -> Value | None:
    """V as the top rod really strikes, on the board or on the rods that lie there."""
    return None if drop.strike is None else drop.strike.speed


def _separation_strike(drop: Adjusted) -> Value | None:
    """Δz as the top rod really strikes, had both chains been let go together."""
    if not drop.both or drop.strike is None:
        return None
    above, when, _ = drop.strike
    value, gradient = drop.apart(when[0] + drop.skew[0], when[1] + drop.skew[1])
    return value - above[0], gradient - above[1]


COMPUTED: dict[str, Callable[[Adjusted], Value | None]] = {
    "separation_m": _separation,
    "separation_raw_m": _separation_raw,
    "separation_strike_m": _separation_strike,
    "release_skew_s": _release_skew,
    "speed_m_s": _speed,
    "speed_strike_m_s": _speed_strike,
    "fall_time_s": _fall_time,
    "gravity_m_s2": _gravity,
    "acceleration_m_s2": _track_acceleration,
}
"""How each row of `rig.measurands` follows from the unknowns; `None` where the scene has none."""
