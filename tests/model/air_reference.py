"""The fall in air with many digits, written from its equation of motion alone.

Between impacts dv/dt = g − κv², so that v² and the way follow in closed form; the free chain falls
all its way with the first κ. Nothing of `rig.model` is used.
"""

from mpmath import mp

from tests.model.reference import End

DIGITS = 60


def reference_air_fall(masses, heights, alpha, gamma, drags, drop, gravity, initial_speed=0) -> End:
    """Drop both chains; `drags` are the rods' c in c v²."""
    with mp.workdps(DIGITS):
        masses, heights, drags = ([mp.mpf(x) for x in each] for each in (masses, heights, drags))
        alpha, gamma, g, start, drop = map(mp.mpf, (alpha, gamma, gravity, initial_speed, drop))
        clock, speed, before = mp.mpf(0), start, -drop
        for k, height in enumerate(heights):
            kappa = mp.fsum(drags[k:]) / mp.fsum(masses[k:])
            terminal, rate = mp.sqrt(g / kappa), mp.sqrt(g * kappa)
            decay = kappa * (height - before)
            share = 1 - (speed / terminal) ** 2
            final = terminal * mp.sqrt(1 - share * mp.exp(-2 * decay))
            # artanh v₁/u − artanh v₀/u, with the zeros at v = u cancelled
            clock += (decay + mp.log((final + terminal) / (speed + terminal))) / rate
            speed, before = final, height
            rest = mp.fsum(masses[k + 1 :])
            if rest > 0:
                speed += alpha * masses[k] * speed / (1 + gamma * masses[k] / rest) / rest
        twin = drop + heights[-1] - reference_way(drags, masses, g, start, clock)
        return End(+twin, +final, +clock)


def reference_way(drags, masses, gravity, initial_speed, time):
    """How far a chain that strikes nothing falls."""
    with mp.workdps(DIGITS):
        kappa = mp.fsum(map(mp.mpf, drags)) / mp.fsum(map(mp.mpf, masses))
        terminal, x = mp.sqrt(gravity / kappa), mp.sqrt(gravity * kappa) * time
        return mp.log(mp.cosh(x) + initial_speed / terminal * mp.sinh(x)) / kappa
