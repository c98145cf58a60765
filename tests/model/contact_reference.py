"""The fall with impacts that last, written twice more with many digits.

Nothing of `rig.model` is used. Once every pull so far is summed up at every moment, the response
integrated by hand; once the differential equation is solved by the exponential of its matrix. Both
look for the moment of each impact in the way fallen since release.
"""

from __future__ import annotations

import mpmath
from mpmath import mp

from tests.model.reference import DIGITS, End


def response(since, contact_time):
    """a(t)/ΔV = (t/τ'²) exp(−t/τ'), τ' = τ/2."""
    half = contact_time / 2
    return since / half**2 * mp.exp(-since / half)


def speed_of_response(since, contact_time):
    x = 2 * since / contact_time
    return 1 - (1 + x) * mp.exp(-x)


def way_of_response(since, contact_time):
    return since - contact_time + (since + contact_time) * mp.exp(-2 * since / contact_time)


def superposed_fall(
    heights, gains, drop, gravity, contact_time, initial_speed=0, *, digits=DIGITS
) -> End:
    with mp.workdps(digits):
        g, tau, start, drop = map(mp.mpf, (gravity, contact_time, initial_speed, drop))
        pulls: list[tuple[mpmath.mpf, mpmath.mpf]] = []

        def pulled(time):
            """What the pulls have added to the way and to the speed."""
            way = mp.fsum(dv * way_of_response(time - begin, tau) for begin, dv in pulls)
            return way, mp.fsum(dv * speed_of_response(time - begin, tau) for begin, dv in pulls)

        time = separation = mp.mpf(0)
        speed = start
        for height, gain in zip(heights, gains, strict=True):
            target = drop + mp.mpf(height)
            if target > 0:
                # Free fall takes longest, and the way is convex: Newton's method from above.
                time = max(time, 2 * target / (start + mp.sqrt(start**2 + 2 * g * target)))
                step = time
                while abs(step) > time * mp.mpf(10) ** (20 - digits):
                    separation, gained = pulled(time)
                    speed = start + g * time + gained
                    step = ((start + g * time / 2) * time + separation - target) / speed
                    time -= step
                separation, gained = pulled(time)
                speed = start + g * time + gained
            pulls.append((time, speed * mp.mpf(gain)))
        return End(separation, speed, time)


def exponential_fall(
    heights, gains, drop, gravity, contact_time, initial_speed=0, *, digits=90
) -> End:
    """State (way, v, a₂, a₁, 1): y(t) = exp(A t) y(0) between impacts."""
    with mp.workdps(digits):
        g, rate, start = mp.mpf(gravity), 2 / mp.mpf(contact_time), mp.mpf(initial_speed)
        equation = mp.matrix(
            [
                [0, 1, 0, 0, 0],
                [0, 0, 1, 0, g],
                [0, 0, -rate, rate, 0],
                [0, 0, 0, -rate, 0],
                [0, 0, 0, 0, 0],
            ]
        )
        state = mp.matrix([-mp.mpf(drop), start, 0, 0, 1])
        time = mp.mpf(0)
        for height, gain in zip(heights, gains, strict=True):
            distance = height - state[0]
            if distance > 0:
                leg = 2 * distance / (state[1] + mp.sqrt(state[1] ** 2 + 2 * g * distance))
                step = leg
                while abs(step) > leg * mp.mpf(10) ** (30 - digits):
                    later = mp.expm(equation * leg) * state
                    step = (later[0] - height) / later[1]
                    leg -= step
                state = mp.expm(equation * leg) * state
                time += leg
            final = state[1]
            state[3] += final * mp.mpf(gain) * rate
        free = (start + g * time / 2) * time - mp.mpf(drop)
        return End(state[0] - free, final, time)
