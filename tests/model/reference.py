"""Legs and hits of a fall in as many digits as are set, straight from the equations.

Nothing of `rig.model` is used. Between impacts dv/dt = g − κv², so that v² and the way follow in
closed form, below κ = 0 too. Whole falls, α and the continuum are `rig.bench.references`'.
"""

import mpmath
from mpmath import mp


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
