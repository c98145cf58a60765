"""The discrete fall in 50 digits, written straight from the paper's equations.

No care is taken to keep digits, since there are plenty: times are (V' − V)/g, and Δz is the
difference of two heights.
"""

from __future__ import annotations

import decimal
import math
from collections.abc import Sequence
from decimal import Decimal
from itertools import accumulate
from typing import NamedTuple

import mpmath

DIGITS = 50
_SPARE = 25  # lost to the differences above at α = 1e-15


class Exact(NamedTuple):
    """Δz, V and t of one fall."""

    separation: Decimal
    speed: Decimal
    time: Decimal


def exact_fall(
    masses: Sequence[float],
    heights: Sequence[float],
    alphas: Sequence[Decimal],
    gammas: Sequence[Decimal],
    drop: float,
    gravity: float,
    initial_speed: float = 0.0,
    kappa: float = 0.0,
) -> Exact:
    """Eqs. 9 and 1 rod by rod, with g − κv² in air; floats are taken at their exact value."""
    reach = drop + heights[-1]
    if kappa:
        # The free chain's way is the logarithm of nearly 1, over κ, and a speed in thick air is
        # nearly the terminal one: hardly any air and very much of it both take digits.
        spare = max(0, round(-4.0 * math.log10(kappa))) + round(kappa * reach)
    else:
        # A fast chain hardly gains speed in a leg, and (V' − V)/g lives on what is left of it.
        slow = gravity * reach
        fast = 2.0 * math.log10(initial_speed) - math.log10(slow) if initial_speed and slow else 0.0
        spare = max(0, round(fast))
    context = decimal.Context(
        prec=DIGITS + _SPARE + spare, Emin=decimal.MIN_EMIN, Emax=decimal.MAX_EMAX
    )
    with decimal.localcontext(context):
        g, k, start = Decimal(gravity), Decimal(kappa), Decimal(initial_speed)
        exact = [Decimal(mass) for mass in masses]
        # From the top: a light end would be lost in the sum of a chain over many decades.
        above = [*accumulate(reversed(exact[1:]))][::-1]
        time, speed, before = Decimal(0), start, -Decimal(drop)
        arrival = speed
        for n, (m, height) in enumerate(zip(exact, map(Decimal, heights), strict=True)):
            arrival, duration = _exact_leg(height - before, speed, g, k)
            time += duration
            speed = arrival
            if n < len(above):
                pull = alphas[n] * m * arrival / (1 + gammas[n] * m / above[n])
                speed += pull / above[n]
            before = height
        top = Decimal(drop) + Decimal(heights[-1])
        return Exact(top - _exact_way(time, start, g, k), arrival, time)


def _exact_leg(
    distance: Decimal, speed: Decimal, gravity: Decimal, kappa: Decimal
) -> tuple[Decimal, Decimal]:
    """Speed at the end of a leg and its duration, as textbooks have them."""
    if not distance:
        return speed, Decimal(0)
    if not kappa:
        arrival = (speed * speed + 2 * gravity * distance).sqrt()
        return arrival, (arrival - speed) / gravity if gravity else distance / speed
    terminal, fading = (gravity / kappa).sqrt(), (-2 * kappa * distance).exp()
    arrival = (speed * speed * fading + terminal * terminal * (1 - fading)).sqrt()
    ratio = (terminal + arrival) * (terminal - speed) / ((terminal - arrival) * (terminal + speed))
    return arrival, ratio.ln() / (2 * (gravity * kappa).sqrt())


def _exact_way(time: Decimal, start: Decimal, gravity: Decimal, kappa: Decimal) -> Decimal:
    """How far the chain that strikes nothing has fallen."""
    if not kappa:
        return start * time + gravity * time * time / 2
    grown, share = ((gravity * kappa).sqrt() * time).exp(), start / (gravity / kappa).sqrt()
    return (((1 + share) * grown + (1 - share) / grown) / 2).ln() / kappa


def exact_coefficients(
    restitution: float,
    friction: float,
    incline_deg: float,
    inertia: float,
    inertia_z: float | None = None,
) -> tuple[Decimal, Decimal]:
    """α by Eqs. 12 and 13, γ by Eq. 10."""
    with mpmath.workdps(DIGITS + _SPARE):
        beta, mu = mpmath.mpf(restitution), mpmath.mpf(friction)
        xi = mpmath.mpf(inertia)
        xi_z = xi if inertia_z is None else mpmath.mpf(inertia_z)
        theta = mpmath.mpf(incline_deg) * mpmath.pi / 180
        cos, sin = mpmath.cos(theta), mpmath.sin(theta)
        g = mpmath.mpf(1)
        if incline_deg == 90.0:
            cos = mpmath.mpf(0)  # and Eq. 12 with it
        elif incline_deg:
            bracket = (1 - mu * cos / sin) / (1 + mu * sin / cos)
            g = cos**2 + sin**2 / 4 * (1 + 1 / xi_z) * (1 + xi) * bracket
        alpha = (1 + beta) / 4 * (1 - xi) * cos**2 / g
        gamma = (1 + xi) / 4 * (1 + 1 / xi)
        return Decimal(mpmath.nstr(alpha, DIGITS + 20)), Decimal(mpmath.nstr(gamma, DIGITS + 20))
