"""Falls and impacts written a second time, in many digits, straight from the equations.

Nothing of `rig.model` is used. Between impacts dv/dt = g − κv², so that v² and the way follow in
closed form, below κ = 0 too; the free chain falls all its way with the first κ. The arithmetic has
so many digits that a form which loses some (the separation as a difference of two heights) may be
taken as it stands. Of a continuum `printed_squared_speed` takes Eq. 14 as it stands, and
`closed_end` has the integral S15 in closed form, a hypergeometric function.
"""

from typing import NamedTuple

import mpmath
from mpmath import mp

AIR_DIGITS = 60


class End(NamedTuple):
    separation: mpmath.mpf
    speed: mpmath.mpf
    time: mpmath.mpf


def reference_air_fall(masses, heights, alpha, gamma, drags, drop, gravity, initial_speed=0) -> End:
    """Drop both chains; `drags` are the rods' c in c v²."""
    with mp.workdps(AIR_DIGITS):
        masses, drags = ([mp.mpf(x) for x in each] for each in (masses, drags))
        kappas = [mp.fsum(drags[k:]) / mp.fsum(masses[k:]) for k in range(len(masses))]
        gains = exact_gains(masses, [alpha] * len(masses), gamma)
        return End(*(+x for x in exact_fall(heights, gains, kappas, drop, gravity, initial_speed)))


def reference_way(drags, masses, gravity, initial_speed, time):
    """How far a chain that strikes nothing falls."""
    with mp.workdps(AIR_DIGITS):
        kappa = mp.fsum(map(mp.mpf, drags)) / mp.fsum(map(mp.mpf, masses))
        return exact_way(time, initial_speed, gravity, kappa)


def exact_gains(masses, alphas, gamma) -> list[mpmath.mpf]:
    """ΔV/V of each impact: J = α m V / (1 + γ m/M), ΔV = J/M (Eq. 9); none of the last."""
    masses = [mp.mpf(mass) for mass in masses]
    gamma, gains = mp.mpf(gamma), []
    for k, mass in enumerate(masses[:-1]):
        rest = mp.fsum(masses[k + 1 :])
        gains.append(mp.mpf(alphas[k]) * mass / (1 + gamma * mass / rest) / rest)
    return [*gains, mp.mpf(0)]


def exact_leg(distance, speed, gravity, kappa):
    """Speed and time at the end, as d(v²)/dz = 2(g − κv²) and dt = dv/(g − κv²) integrate."""
    d, v, g, k = map(mp.mpf, (distance, speed, gravity, kappa))
    if not k and not g:
        return v, d / v
    if not k:
        arrival = mp.sqrt(v * v + 2 * g * d)
        return arrival, (arrival - v) / g
    left, u = mp.exp(-2 * k * d), mp.sqrt(g / k)
    arrival = mp.sqrt(g / k - (g / k - v * v) * left)
    # artanh v₁/u − artanh v₀/u, with the zeros at v = u cancelled
    return arrival, mp.re((k * d + mp.log((arrival + u) / (v + u))) * u / g)


def exact_way(time, speed, gravity, kappa):
    """How far something falls in a time."""
    t, v, g, k = map(mp.mpf, (time, speed, gravity, kappa))
    if not k:
        return v * t + g * t * t / 2
    x = mp.sqrt(k * g) * t
    return mp.re(mp.log(mp.cosh(x) + v * mp.sqrt(k / g) * mp.sinh(x)) / k)


def exact_hits(heights, gains, kappas, drop, gravity, speed) -> list[tuple]:
    """Time of each impact, and speed before and after it, with the digits that are set."""
    now = mp.mpf(speed)
    time, before, hits = mp.mpf(0), -mp.mpf(drop), []
    for height, gain, kappa in zip(map(mp.mpf, heights), gains, kappas, strict=True):
        arrival = now
        if height != before:
            arrival, leg = exact_leg(height - before, now, gravity, kappa)
            time += leg
        now, before = arrival * (1 + mp.mpf(gain)), height
        hits.append((time, arrival, now))
    return hits


def exact_fall(heights, gains, kappas, drop, gravity, speed) -> End:
    """Δz as a difference of two heights, V and t, with the digits that are set."""
    time, arrival, _ = exact_hits(heights, gains, kappas, drop, gravity, speed)[-1]
    top = mp.mpf(drop) + mp.mpf(heights[-1])
    separation = top - exact_way(time, speed, gravity, kappas[0])
    # Two chains that end at one height differ by rounding: no digits are left to be taken for a Δz.
    return End(mp.chop(separation, tol=1e10 * mp.eps), arrival, time)


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


CONTINUUM_DIGITS = 120


class ContinuumEnd(NamedTuple):
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


def closed_end(length, reach, alpha, drop, gravity, initial_speed=0) -> ContinuumEnd:
    """With v = ((z + γs)/(z₀ + γs))^(1+2α), S15 is ∫ v^(b−1) (c − d v)^(−1/2) dv, b = (1+α)/(1+2α).

    For g > 0.
    """
    with mp.workdps(CONTINUUM_DIGITS):
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
        return ContinuumEnd(separation, speed, time)
