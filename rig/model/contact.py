"""Impacts that last: each impulse spread over a contact time, the stiff form of the discrete fall.

A rod's impulse does not act at once but through a critically damped response: the pull rises
from zero, and is over after a few contact times,

    a(t) = ΔV · (t/τ'²) · exp(−t/τ'),   τ' = τ/2,

so that τ is the mean delay of the pull and the whole of it still is ΔV (Eq. 9). With τ → 0 this
is the discrete model. As a differential equation,

    s' = v,   v' = g + a₂,   a₂' = (a₁ − a₂)/τ',   a₁' = −a₁/τ',   a₁ += ΔV/τ' at each impact,

it has the eigenvalue −2/τ twice: an explicit solver must take steps of the order of τ all the way
down, whatever accuracy is asked for. Here every leg is solved in closed form.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rig.errors import DomainError
from rig.model.fall import Fall

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.model.chain import Chain

_TERMS = 28  # of the series below: the last is under 1e-18 of the first for x ≤ 2
_SERIES = 2.0  # up to here the series keeps digits that the closed form cancels
_STEPS = 60  # of Newton's method; it takes fewer than ten


def contact_fall(
    chain: Chain,
    gains: Sequence[float],
    drop: float,
    gravity: float,
    contact_time: float,
    initial_speed: float = 0.0,
) -> Fall:
    """Δz, V and t when each impulse takes its time.

    Parameters
    ----------
    gains
        ΔV/V of each impact, as from `rig.model.fall.kicks`; none negative.
    drop, gravity, initial_speed
        As in `rig.model.fall.hits`.
    contact_time
        τ, s.

    Raises
    ------
    DomainError
        As `check_contact`, or where nothing ever moves.
    """
    check_contact(gains, contact_time)
    tau = 0.5 * contact_time
    time = separation = gained = 0.0
    first = second = 0.0  # τ'a₁ and τ'a₂: speed that is still to come
    speed, before = initial_speed, -drop
    for height, gain in zip(chain.heights, gains, strict=True):
        duration = _leg(height - before, speed, gravity, first, second, tau)
        x = duration / tau
        one, two = _ramp(x)
        separation += gained * duration + tau * (first * one + second * two)
        # What has come of either stage; what is left of it comes later.
        one, two = _risen(x, one, two)
        grown = first * one + second * two
        ahead = math.exp(-x)
        second = (second + first * x) * ahead
        first *= ahead
        gained += grown
        speed += gravity * duration + grown
        time += duration
        before = height
        first += speed * gain
    return Fall(separation, speed, time)


def check_contact(gains: Sequence[float], contact_time: float) -> None:
    """Refuse what impacts that last cannot be worked out for.

    Raises
    ------
    DomainError
        For a contact time that is not above zero and finite, or a negative gain.
    """
    if not 0.0 < contact_time < math.inf:
        raise DomainError(
            f"a contact time of {contact_time:g} s", "give one above zero, or use the discrete fall"
        )
    if not all(gain >= 0.0 for gain in gains):
        raise DomainError("a rod that pushes the chain up", "α must not be negative here")


def _leg(
    distance: float, speed: float, gravity: float, first: float, second: float, tau: float
) -> float:
    """Time in which the chain comes down by `distance`, by Newton's method from above.

    The way fallen, s, is a convex function of time, so from a time that is too long the method
    comes down to the root and never jumps over it. With s' t − s summed up by itself, which has
    no negative part, a step t ← (d + s' t − s)/s' keeps all digits however far it goes; where the
    pull is many times the speed, t − (s − d)/s' would lose as many as it comes down by.
    """
    if distance == 0.0:
        return 0.0
    arrival = math.sqrt(speed * speed + 2.0 * gravity * distance)
    if arrival == 0.0:
        raise DomainError("the chain never falls: no gravity and no initial speed")
    duration = 2.0 * distance / (speed + arrival)
    for _ in range(_STEPS):
        x = duration / tau
        one, two = _ramp(x)
        risen, other = _risen(x, one, two)
        ahead = 0.5 * gravity * duration**2 + tau * (first * _left(x, one, risen) + second * risen)
        later = (distance + ahead) / (speed + gravity * duration + first * risen + second * other)
        if not later < duration:
            break
        duration = later
    return duration


def _ramp(x: float) -> tuple[float, float]:
    """Way gained by the two stages of the response after x = t/τ', in units of τ' × speed.

    x − 2 + (2 + x)e⁻ˣ and x − 1 + e⁻ˣ, by their series where those forms would cancel.
    """
    if x > _SERIES:
        ahead = math.exp(-x)
        return x - 2.0 + (2.0 + x) * ahead, x - 1.0 + ahead
    one = two = 0.0
    term = x  # xⁿ/n!, alternating
    for n in range(2, _TERMS):
        term *= -x / n
        one += (n - 2) * term
        two -= term
    return one, two


def _risen(x: float, one: float, two: float) -> tuple[float, float]:
    """Speed gained by the two stages after x, in units of all that will come.

    1 − (1 + x)e⁻ˣ and 1 − e⁻ˣ; the first is the difference of the ways `one` and `two` of `_ramp`,
    which keeps the digits that the closed form cancels where a leg is short against τ.
    """
    if x > _SERIES:
        return -math.expm1(-x) - x * math.exp(-x), -math.expm1(-x)
    return two - one, -math.expm1(-x)


def _left(x: float, one: float, risen: float) -> float:
    """Product of x and speed less the way, of the first stage: 2 − (2 + 2x + x²)e⁻ˣ.

    Of the second stage it is the speed gained by the first.
    """
    if x > _SERIES:
        return 2.0 - (2.0 + (2.0 + x) * x) * math.exp(-x)
    return x * risen - one
