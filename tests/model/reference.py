"""The discrete fall and the impact, written a second time straight from the equations.

Nothing of `rig.model` is used. Arithmetic has so many digits that a form which loses some (the
separation as a difference of two heights) may be taken as it stands.
"""

from mpmath import mp

from tests.model.air_reference import End, exact_fall, exact_gains

DIGITS = 150
"""The worst case of `tests.model.chains` cancels about 90 of them."""


def reference_fall(
    masses, heights, alpha, gamma, drop, gravity, initial_speed=0, *, digits=DIGITS
) -> End:
    """Drop both chains, without air."""
    with mp.workdps(digits):
        still = [0] * len(masses)
        gains = exact_gains(masses, [alpha] * len(masses), gamma)
        return exact_fall(heights, gains, still, drop, gravity, initial_speed)


def printed_alpha(restitution, friction, incline_deg, inertia):
    """α as Eqs. 12 and 13 are printed, with cot θ and tan θ; 0° < θ < 90°."""
    with mp.workdps(50):
        beta, mu, xi = map(mp.mpf, (restitution, friction, inertia))
        theta = mp.radians(mp.mpf(incline_deg))
        bracket = (1 - mu * mp.cot(theta)) / (1 + mu * mp.tan(theta))
        g = mp.cos(theta) ** 2 + mp.sin(theta) ** 2 * (1 + 1 / xi) * (1 + xi) / 4 * bracket
        return (1 + beta) / 4 * (1 - xi) * mp.cos(theta) ** 2 / g
