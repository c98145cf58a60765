"""The continuum fall written a second time, in many digits; nothing of `rig.model` is used.

`printed_end` takes Eq. 14, S15 and S16 as they stand, by mpmath's own quadrature. `closed_end` has
the integral S15 in closed form, a hypergeometric function, which is quick enough for hypothesis.
Both take the separation as a difference of two heights, for which there are digits to spare.
"""

from typing import NamedTuple

import mpmath
from mpmath import mp

DIGITS = 120


class End(NamedTuple):
    separation: mpmath.mpf
    speed: mpmath.mpf
    lay_down: mpmath.mpf


def printed_squared_speed(z, length, reach, alpha, drop, gravity, initial_speed):
    """Eq. 14 with h raised by v²/2g; without gravity its limit v² ((z₀ + γs)/(z + γs))^2α."""
    power = 2 * alpha
    if gravity == 0:
        return initial_speed**2 * ((length + reach) / (z + reach)) ** power
    h = drop + initial_speed**2 / (2 * gravity)
    whole, part = length + reach, z + reach
    braces = h * whole**power + (whole ** (1 + power) - part ** (1 + power)) / (1 + power)
    return 2 * gravity / part**power * braces


def closed_end(length, reach, alpha, drop, gravity, initial_speed=0) -> End:
    """With v = ((z + γs)/(z₀ + γs))^(1+2α), S15 is ∫ v^(b−1) (c − d v)^(−1/2) dv, b = (1+α)/(1+2α).

    For g > 0.
    """
    with mp.workdps(DIGITS):
        given = [mp.mpf(v) for v in (length, reach, alpha, drop, gravity, initial_speed)]
        z0, r, a, h, g, start = given
        k = 1 + 2 * a
        whole, d = z0 + r, 2 * g * (z0 + r) / k
        c = start**2 + 2 * g * h + d
        b = (1 + a) / k

        def primitive(v):
            return v**b / b * mp.hyp2f1(0.5, b, b + 1, v * d / c) if v else mp.mpf(0)

        time = whole / k / mp.sqrt(c) * (primitive(mp.mpf(1)) - primitive((r / whole) ** k))
        separation = z0 - mp.sqrt(c - d) * time - g * time**2 / 2
        speed = mp.inf if r == 0 else mp.sqrt(printed_squared_speed(mp.mpf(0), *given))
        return End(separation, speed, time)
