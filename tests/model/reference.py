"""The discrete fall and the impact, written a second time straight from the equations.

Nothing of `rig.model` is used. Arithmetic has so many digits that the forms which lose some
(a leg's time from the quadratic formula, the separation as a difference of two heights) may be
taken as they stand.
"""

from typing import NamedTuple

import mpmath
from mpmath import mp

DIGITS = 150
"""The worst case of `tests.model.chains` cancels about 90 of them."""


class End(NamedTuple):
    separation: mpmath.mpf
    speed: mpmath.mpf
    time: mpmath.mpf


def reference_fall(
    masses, heights, alpha, gamma, drop, gravity, initial_speed=0, *, digits=DIGITS
) -> End:
    """Drop both chains; J = α m V / (1 + γ m/M) and ΔV = J/M at each impact (Eq. 9)."""
    with mp.workdps(digits):
        masses = [mp.mpf(m) for m in masses]
        heights = [mp.mpf(z) for z in heights]
        alpha, gamma, g, start = map(mp.mpf, (alpha, gamma, gravity, initial_speed))
        bottom = mp.mpf(drop)  # height of the bottom rod's middle above the contact point
        twin = bottom + heights[-1]  # height of the free chain's top rod
        clock, speed, twin_speed = mp.mpf(0), start, start
        for k, height in enumerate(heights):
            # Rod k strikes when ½ g t² + speed · t = its height above the contact point.
            above_contact = bottom + height
            root = mp.sqrt(speed**2 + 2 * g * above_contact)
            leg = (root - speed) / g
            clock += leg
            bottom -= speed * leg + g * leg**2 / 2
            twin -= twin_speed * leg + g * leg**2 / 2
            speed += g * leg
            twin_speed += g * leg
            final = speed
            rest = mp.fsum(masses[k + 1 :])
            if rest > 0:
                impulse = alpha * masses[k] * speed / (1 + gamma * masses[k] / rest)
                speed += impulse / rest
        return End(twin - (bottom + heights[-1]), final, clock)


def printed_alpha(restitution, friction, incline_deg, inertia):
    """α as Eqs. 12 and 13 are printed, with cot θ and tan θ; 0° < θ < 90°."""
    with mp.workdps(50):
        beta, mu, xi = map(mp.mpf, (restitution, friction, inertia))
        theta = mp.radians(mp.mpf(incline_deg))
        bracket = (1 - mu * mp.cot(theta)) / (1 + mu * mp.tan(theta))
        g = mp.cos(theta) ** 2 + mp.sin(theta) ** 2 * (1 + 1 / xi) * (1 + xi) / 4 * bracket
        return (1 + beta) / 4 * (1 - xi) * mp.cos(theta) ** 2 / g
