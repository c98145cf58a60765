"""The fall with impacts that last, written once more with many digits.

Nothing of `rig.model` is used. Every pull so far is summed up at every moment, the response
integrated by hand: a(t)/ΔV = (t/τ'²) exp(−t/τ'), τ' = τ/2. The moment of each impact is looked for
in the way fallen since release.
"""

from __future__ import annotations

import mpmath
from mpmath import mp

from tests.model.reference import DIGITS, End


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
