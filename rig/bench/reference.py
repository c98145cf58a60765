"""The discrete fall in 50 digits, written straight from the paper's equations.

No care is taken to keep digits, since there are plenty: times are (V' − V)/g, and Δz is the
difference of two heights.
"""

from __future__ import annotations

import decimal
import math
from decimal import Decimal
from itertools import accumulate
from typing import TYPE_CHECKING, NamedTuple

import mpmath

if TYPE_CHECKING:
    from collections.abc import Sequence

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
) -> Exact:
    """Eqs. 9 and 1 rod by rod; floats are taken at their exact value."""
    # A fast chain hardly gains speed in a leg, and (V' − V)/g lives on what is left of it.
    slow = gravity * (drop + heights[-1])
    fast = 2.0 * math.log10(initial_speed) - math.log10(slow) if initial_speed and slow else 0.0
    context = decimal.Context(
        prec=DIGITS + _SPARE + max(0, round(fast)), Emin=decimal.MIN_EMIN, Emax=decimal.MAX_EMAX
    )
    with decimal.localcontext(context):
        g, start = Decimal(gravity), Decimal(initial_speed)
        exact = [Decimal(mass) for mass in masses]
        # From the top: a light end would be lost in the sum of a chain over many decades.
        above = [*accumulate(reversed(exact[1:]))][::-1]
        time, speed, before = Decimal(0), start, -Decimal(drop)
        arrival = speed
        for k, (m, height) in enumerate(zip(exact, map(Decimal, heights), strict=True)):
            distance = height - before
            if distance:
                arrival = (speed * speed + 2 * g * distance).sqrt()
                time += (arrival - speed) / g if g else distance / speed
            else:
                arrival = speed
            speed = arrival
            if k < len(above):
                pull = alphas[k] * m * arrival / (1 + gammas[k] * m / above[k])
                speed += pull / above[k]
            before = height
        top = Decimal(drop) + Decimal(heights[-1])
        return Exact(top - start * time - g * time * time / 2, arrival, time)


def exact_air_fall(
    masses: Sequence[float],
    heights: Sequence[float],
    alphas: Sequence[Decimal],
    gammas: Sequence[Decimal],
    drop: float,
    gravity: float,
    kappa: float,
    initial_speed: float = 0.0,
) -> Exact:
    """Eq. 9 rod by rod, and g − κv² between, integrated as textbooks have it; κ > 0, g > 0."""
    # The free chain's way is the logarithm of nearly 1, over κ, and a speed in thick air is nearly
    # the terminal one: hardly any air and very much of it both take digits.
    spare = _SPARE + max(0, round(-4.0 * math.log10(kappa)))
    spare += round(kappa * (drop + heights[-1]))
    with mpmath.workdps(DIGITS + spare):
        g, k = mpmath.mpf(gravity), mpmath.mpf(kappa)
        terminal = mpmath.sqrt(g / k)
        masses_ = [mpmath.mpf(mass) for mass in masses]
        above = [*accumulate(reversed(masses_[1:]))][::-1]
        start = mpmath.mpf(initial_speed)
        time, speed, before = mpmath.mpf(0), start, -mpmath.mpf(drop)
        arrival = speed
        for n, (m, height) in enumerate(zip(masses_, map(mpmath.mpf, heights), strict=True)):
            fading = mpmath.exp(-2 * k * (height - before))
            arrival = mpmath.sqrt(speed**2 * fading + terminal**2 * (1 - fading))
            gone = (terminal + arrival) * (terminal - speed)
            time += mpmath.log(gone / ((terminal - arrival) * (terminal + speed))) / (
                2 * mpmath.sqrt(g * k)
            )
            speed = arrival
            if n < len(above):
                alpha, gamma = mpmath.mpf(str(alphas[n])), mpmath.mpf(str(gammas[n]))
                speed += alpha * m * arrival / (1 + gamma * m / above[n]) / above[n]
            before = height
        turns = mpmath.sqrt(g * k) * time
        way = mpmath.log(mpmath.cosh(turns) + start / terminal * mpmath.sinh(turns)) / k
        apart = mpmath.mpf(drop) + mpmath.mpf(heights[-1]) - way
        return Exact(*(Decimal(mpmath.nstr(one, DIGITS)) for one in (apart, arrival, time)))


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
