"""The discrete fall: free fall between impacts, a speed step at each (section III.D).

Two forms that lose digits are avoided on purpose. A leg of length d takes 2d/(V + V'), never
(V' − V)/g; and Δz is the running sum of (speed gained so far) × (leg time), never a difference of
two heights. Δz then keeps full relative precision as α → 0, and g → 0 costs nothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

from rig.model.chain import Chain
from rig.reasons import rig_error

if TYPE_CHECKING:
    from rig.model.impact import Number

Leg = Callable[[float, float, float, int], tuple[float, float]]

SMALL, LARGE = 1e-100, 1e100
"""Range of sizes whose squares are floats."""


@dataclass(frozen=True, slots=True)
class Fall:
    """The end of a fall, at the instant the top rod's middle reaches the contact point.

    Attributes
    ----------
    separation_m
        Δz: height of the free chain's top rod above the contact point.
    speed_m_s
        V: speed of the top rod just before its impact.
    time_s
        Time since release.
    """

    separation_m: float
    speed_m_s: float
    time_s: float


class Hit(NamedTuple):
    """A rod's impact: time, and the chain's speed before and after, downward positive."""

    time_s: float
    speed_before: float
    speed_after: float


def kicks(chain: Chain, alphas: Sequence[float], gamma: float) -> list[float]:
    """Return the relative speed gain ΔV/V of the chain at each rod's impact, from Eq. 9.

    ΔV = J/M with J = α m V / (1 + γ m/M), so ΔV/V = α / (γ + M/m).

    Parameters
    ----------
    alphas
        α of each rod, bottom up, shape ``(rods,)``.
    gamma
        γ of Eq. 10.

    Returns
    -------
    list of float
        Shape ``(rods,)``; 0 for the top rod, which has no mass above. Infinite if the mass above is
        negligible beside the rod's own and γ = 0.
    """
    gains = [
        alpha / (gamma + ratio) if gamma + ratio else math.inf
        for alpha, (_, ratio) in zip(alphas, chain.legs, strict=False)
    ]
    return [*gains, 0.0]


def hits(
    chain: Chain,
    gains: Sequence[float],
    drop: float,
    gravity: float,
    initial_speed: float = 0.0,
    leg: Leg | None = None,
) -> list[Hit]:
    """Return all impacts of a fall, bottom rod first.

    Parameters
    ----------
    gains
        ΔV/V at each impact, as from `kicks`.
    drop
        Bottom rod's middle above the contact point at release, m.
    gravity
        m/s².
    initial_speed
        Downward speed at release, m/s.
    leg
        Function of distance, initial speed, gravity and rod number that returns the final speed
        and duration of the leg before a rod's impact; free fall if not given.
    """
    leg = leg or free_leg
    events: list[Hit] = []
    time, speed, before = 0.0, initial_speed, -drop
    for rod, (height, gain) in enumerate(zip(chain.heights, gains, strict=True)):
        arrival, duration = leg(height - before, speed, gravity, rod)
        time += duration
        speed = arrival * (1.0 + gain)
        before = height
        events.append(Hit(time, arrival, speed))
    return events


def fall(
    chain: Chain,
    alpha: float,
    gamma: float,
    drop: float,
    gravity: float,
    initial_speed: float = 0.0,
) -> Fall:
    """Return Δz, V and t of a fall.

    Parameters
    ----------
    alpha, gamma
        Impact coefficients of Eq. 9.
    drop, gravity, initial_speed
        As in `hits`.

    Raises
    ------
    DomainError
        The chain would never move, without gravity and initial speed; or a speed leaves the range
        of floats.
    """
    length = unit = 0
    if not (
        SMALL < chain.length + drop < LARGE and SMALL < gravity < LARGE and initial_speed < LARGE
    ):
        # In units of the fall's own size no square over- or underflows. Units are powers of two, so
        # that conversions are exact.
        length = math.frexp(chain.length + drop)[1]
        # Exponents of speed; a zero has none.
        speeds = [(math.frexp(gravity)[1] + length) // 2] if gravity else []
        speeds += [math.frexp(initial_speed)[1]] if initial_speed else []
        unit = max(speeds, default=0)
        chain = replace(chain, heights=tuple(math.ldexp(z, -length) for z in chain.heights))
        drop = math.ldexp(drop, -length)
        gravity = math.ldexp(gravity, length - 2 * unit)
        initial_speed = math.ldexp(initial_speed, -unit)
    arrival, time = free_leg(drop, initial_speed, gravity)
    if arrival == 0.0 == gravity:
        raise rig_error("never_falls")
    try:
        ends = after_impacts(chain.legs, alpha, gamma, arrival, time, 2.0 * gravity, math.sqrt)
    except ZeroDivisionError:
        ends = 0.0, math.inf, time
    end = checked_fall(*ends)
    return Fall(
        math.ldexp(end.separation_m, length),
        math.ldexp(end.speed_m_s, unit),
        math.ldexp(end.time_s, length - unit),
    )


def after_impacts(
    legs: Iterable[tuple[float, float]],
    alpha: Number,
    gamma: Number,
    arrival: Number,
    time: Number,
    twice_g: Number,
    root: Callable[[Number], Number],
) -> tuple[Number, Number, Number]:
    """Return Δz, V and t of a fall from the bottom rod's impact on; or of many falls, as arrays.

    Parameters
    ----------
    legs
        See `rig.model.chain.Chain.legs`.
    arrival, time
        Speed and time at the bottom rod's impact, m/s and s.
    twice_g
        2g, m/s².
    root
        Square root of such numbers.
    """
    gained = separation = 0.0 * time
    # `free_leg` inlined: a call takes longer than its arithmetic (see ``./run bench bulk``).
    for gap, ratio in legs:
        step = arrival * (alpha / (gamma + ratio))  # Eq. 9
        gained = gained + step
        speed = arrival + step
        arrival = root(speed * speed + twice_g * gap)
        duration = 2.0 * gap / (speed + arrival)
        time = time + duration
        separation = separation + gained * duration
    return separation, arrival, time


def checked_fall(separation: float, speed: float, time: float) -> Fall:
    """Return the end of a fall from finite numbers.

    Raises
    ------
    DomainError
        A number has left the range of floats.
    """
    if not math.isfinite(separation + speed + time):
        raise rig_error("speed_unbounded")
    return Fall(separation, speed, time)


def free_leg(distance: float, speed: float, gravity: float, _rod: int = 0) -> tuple[float, float]:
    """Return the speed at the end of a free-fall leg, m/s, and its duration, s.

    Raises
    ------
    DomainError
        The chain would never move.
    """
    if distance == 0.0:
        return speed, 0.0
    arrival = math.sqrt(speed * speed + 2.0 * gravity * distance)
    if speed + arrival == 0.0:
        raise rig_error("never_falls")
    return arrival, 2.0 * distance / (speed + arrival)


def air_legs(kappas: Sequence[float]) -> Leg:
    """Return the `leg` function of `hits`; κ before each impact, 1/m, or empty without air."""
    if not kappas:
        return free_leg
    from rig.model.drag import drag_leg  # noqa: PLC0415 - only where there is air

    return lambda distance, speed, gravity, rod: drag_leg(distance, speed, gravity, kappas[rod])
