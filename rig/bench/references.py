"""True values in 50 digits and more, written straight from the equations.

Nothing of `rig.model` is used, floats are taken at their exact value, and no care is taken to keep
digits, since there are plenty: times are (V' − V)/g, and Δz is a difference of heights.
"""

import decimal
import math
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from decimal import Decimal
from itertools import accumulate
from typing import TypeAlias

import mpmath
from mpmath import mp

Number: TypeAlias = float | Decimal
Values: TypeAlias = dict[str, Decimal]
DIGITS = 50
_SPARE = 30
"""Lost to the differences above; x³ of a leg short against the contact time is the worst."""

_MANY = decimal.Context(2 * DIGITS, Emin=decimal.MIN_EMIN, Emax=decimal.MAX_EMAX)
# Digits that κ = 1e-15/m takes, and κd of a leg at whose end a speed is the terminal one to 87.
_THIN, _THICK = 60, 100
_FLOAT = decimal.Context(16, Emin=sys.float_info.min_10_exp, Emax=sys.float_info.max_10_exp)


def many_digits() -> AbstractContextManager[decimal.Context]:
    """Return a context in which quotients of such values keep their digits."""
    return decimal.localcontext(_MANY)


def own_error(exact: Callable[..., Values], inputs: Mapping[str, Number]) -> float:
    """Return how far true values are from those with 20 more digits, relative."""
    values, finer = exact(**inputs), exact(**inputs, digits=DIGITS + 20)
    with many_digits():
        return max(float(abs(value / finer[name] - 1)) for name, value in values.items())


def exact_fall(
    masses: Sequence[Number],
    heights: Sequence[Number],
    alphas: Sequence[Number],
    gammas: Sequence[Number],
    drop: Number,
    gravity: Number,
    initial_speed: Number = 0.0,
    kappas: Sequence[Number] = (),
    digits: int = DIGITS,
    *,
    as_float: bool = False,
) -> Values:
    """Eqs. 9 and 1 rod by rod, in air with g − κv² and each leg's κ; the free chain has the first.

    Parameters
    ----------
    as_float
        Compute with the digits and the range of a float: what a plain program of these equations
        would lose.

    Returns
    -------
    dict
        ``separation``, ``speed`` and ``time``.
    """
    reach = float(drop) + float(heights[-1])
    if kappas:
        # The free chain's way is the logarithm of nearly 1, over κ, and a speed in thick air is
        # nearly the terminal one: hardly any air and very much of it both take digits.
        spare = _THIN + round(2.0 * min(float(max(kappas)) * reach, _THICK))
    else:
        # A fast chain hardly gains speed in a leg, and (V' − V)/g lives on what is left of it.
        slow, fast = float(gravity) * reach, float(initial_speed)
        spare = max(0, round(2.0 * math.log10(fast) - math.log10(slow))) if fast and slow else 0
    spare += round(4.0 * len(masses) * math.log10(max(1.0, *map(float, alphas))))  # so fast it gets
    context = decimal.Context(digits + _SPARE + spare, Emin=decimal.MIN_EMIN, Emax=decimal.MAX_EMAX)
    with decimal.localcontext(_FLOAT if as_float else context):
        g, start = Decimal(gravity), Decimal(initial_speed)
        air = [Decimal(kappa) for kappa in kappas] or [Decimal(0)] * len(masses)
        exact = [Decimal(mass) for mass in masses]
        # From the top: a light end would be lost in the sum of a chain over many decades.
        above = [*[*accumulate(reversed(exact[1:]))][::-1], Decimal("inf")]
        columns = (map(Decimal, column) for column in (heights, alphas, gammas))
        time, speed, before = Decimal(0), start, -Decimal(drop)
        for m, rest, kappa, height, alpha, gamma in zip(exact, above, air, *columns, strict=True):
            arrival, duration = _leg(height - before, speed, g, kappa)
            time += duration
            # Nothing is left for the top rod to pull on, as if all the world's mass were above it.
            speed = arrival + alpha * m * arrival / (1 + gamma * m / rest) / rest
            before = height
        top = Decimal(drop) + Decimal(heights[-1])
        separation = top - _way(time, start, g, air[0])
        if abs(separation) < top.scaleb(-digits):
            separation = Decimal(0)  # as without any pull: what is left is rounding
        return {"separation": separation, "speed": arrival, "time": time}


def _leg(distance: Decimal, speed: Decimal, g: Decimal, kappa: Decimal) -> tuple[Decimal, Decimal]:
    """Speed at the end of a leg and its duration, as textbooks have them."""
    if not distance:
        return speed, Decimal(0)
    if not kappa:
        arrival = (speed * speed + 2 * g * distance).sqrt()
        return arrival, (arrival - speed) / g if g else distance / speed
    terminal, fading = (g / kappa).sqrt(), (-2 * kappa * distance).exp()
    arrival = (speed * speed * fading + terminal * terminal * (1 - fading)).sqrt()
    rate, faster = (g * kappa).sqrt(), (terminal + arrival) / (terminal + speed)
    # In thick air the next line would take as many digits; at the terminal speed it is 0/0.
    if kappa * distance > _THICK or speed == terminal:
        return arrival, (kappa * distance + faster.ln()) / rate
    return arrival, (faster * (terminal - speed) / (terminal - arrival)).ln() / (2 * rate)


def _way(time: Decimal, start: Decimal, g: Decimal, kappa: Decimal) -> Decimal:
    """How far the chain that strikes nothing has fallen."""
    if not kappa:
        return start * time + g * time * time / 2
    grown, share = ((g * kappa).sqrt() * time).exp(), start / (g / kappa).sqrt()
    return (((1 + share) * grown + (1 - share) / grown) / 2).ln() / kappa


def exact_coefficients(inputs: Mapping[str, Number], *, as_float: bool = False) -> Values:
    """Return ``alpha`` by Eqs. 12 and 13, ``gamma`` by Eq. 10; `as_float` as in `exact_fall`."""
    with mp.workdps(15 if as_float else DIGITS + _SPARE):
        names = ("restitution", "friction", "inertia", "incline")
        beta, mu, xi, degrees = (mp.mpf(inputs[name]) for name in names)
        xi_z = mp.mpf(inputs.get("inertia_z", inputs["inertia"]))
        theta = degrees * mp.pi / 180
        # Eq. 12 has no vertical part at a wall.
        cos, sin = mp.cos(theta) if degrees != 90 else mp.mpf(0), mp.sin(theta)
        g = mp.mpf(1)
        if cos and sin:
            bracket = (1 - mu * cos / sin) / (1 + mu * sin / cos)
            g = cos**2 + sin**2 / 4 * (1 + 1 / xi_z) * (1 + xi) * bracket
        alpha = (1 + beta) / 4 * (1 - xi) * cos**2 / g
        return _decimals(alpha=alpha, gamma=(1 + xi) / 4 * (1 + 1 / xi))


def lasting_impacts(
    heights: Sequence[float], gains: Sequence[float], drop: float, gravity: float,
    contact_s: Number, digits: int = DIGITS,
) -> Values:  # fmt: skip
    """Solve `rig.bench.solvers.lasting_impacts` by series in w, leg by leg.

    As a function of w, dv/dw = −gτ/w − v, so v = e^−w (C − gτ Ei(w)), and the way is τ∫v dw/w.
    """
    with mp.workdps(digits + _SPARE):
        g, tau = mp.mpf(gravity), mp.mpf(contact_s)
        before = mp.mpf(heights[0])
        speed = mp.sqrt(2 * g * drop)
        time, pull = speed / g, mp.mpf(0)
        for height, gain in zip(heights[1:], gains, strict=False):
            distance, before = mp.mpf(height) - before, mp.mpf(height)
            pull += mp.log1p(mp.mpf(gain))
            log = mp.log(pull)
            s, way_one, way_log = _exponential_series(pull, log)
            c = speed * mp.exp(pull) + g * tau * (log + s)
            start = c * way_one - g * tau * way_log
            leg = 2 * distance / (speed + mp.sqrt(speed**2 + 2 * g * distance))
            step = leg
            # The way is convex in time and no leg is longer than free fall: Newton from above,
            # whose last step is too short to count even in the speed.
            while abs(step) > leg * mp.mpf(10) ** -(digits + _SPARE // 2):
                w, now = pull * mp.exp(-leg / tau), log - leg / tau
                s, way_one, way_log = _exponential_series(w, now)
                speed = mp.exp(-w) * (c - g * tau * (now + s))
                step = (tau * (start - c * way_one + g * tau * way_log) - distance) / speed
                leg -= step
            time, pull = time + leg, w
        return _decimals(separation=mp.mpf(drop) + before - g * time**2 / 2, speed=speed, time=time)


def _exponential_series(w: mpmath.mpf, log: mpmath.mpf) -> tuple[mpmath.mpf, ...]:
    """Ei(w) − ln w − γ; ∫ e^−w/w dw; and ∫ e^−w (Ei(w) − γ)/w dw; with ln w given."""
    above, one, both = mp.mpf(0), log, log**2 / 2
    power, harmonic, k = mp.mpf(1), mp.mpf(0), 0
    while abs(power) > mp.eps and w:
        k += 1
        power *= w / k
        harmonic += mp.mpf(1) / k
        alternating = (-1) ** k * power / k
        above += power / k
        one += alternating
        both += alternating * (log - mp.mpf(1) / k - harmonic)
    return above, one, both


def continuum(
    length: Number,
    reach: Number,
    alpha: Number,
    drop: Number,
    gravity: Number,
    digits: int = DIGITS,
) -> Values:
    """Eq. 14, and the time by S15: with v = ((z + γs)/(z₀ + γs))^(1+2α) a hypergeometric function.

    S15 is ∫ v^(b−1) (c − d v)^(−1/2) dv, b = (1+α)/(1+2α).
    """
    with mp.workdps(digits + _SPARE):
        z0, r, a, h, g = map(mp.mpf, (length, reach, alpha, drop, gravity))
        power, above = 1 + 2 * a, z0 + r
        b, d = (1 + a) / power, 2 * g * above / power
        c = 2 * g * h + d

        def time_to(z: mpmath.mpf) -> mpmath.mpf:
            v = ((z + r) / above) ** power
            primitive = v**b / b * mp.hyp2f1(mp.mpf(1) / 2, b, b + 1, v * d / c)
            return -above / power / mp.sqrt(c) * primitive

        time = mp.sqrt(2 * h / g) + time_to(mp.mpf(0)) - time_to(z0)
        braces = h * above ** (2 * a) + (above**power - r**power) / power
        speed = mp.sqrt(2 * g * braces / r ** (2 * a)) if r else mp.inf
        return _decimals(separation=h + z0 - g * time**2 / 2, speed=speed, time=time)


def fall_time(distance: Number, gravity: Number, kappa: Number, digits: int = DIGITS) -> Values:
    """Return the ``time`` to fall so far from rest in air: arcosh(e^κd)/√(κg)."""
    with mp.workdps(digits + _SPARE):
        d, g, k = map(mp.mpf, (distance, gravity, kappa))
        return _decimals(time=mp.acosh(mp.exp(k * d)) / mp.sqrt(k * g))


def beam_fit(digits: int = DIGITS, **numbers: Number) -> Values:
    """Fit ``rise``, ``speed`` and ``gravity`` of a fall to its times at beams.

    Gauss–Newton on normal equations, which have digits to spare here.

    Parameters
    ----------
    numbers
        First all heights of beams, then all times.
    """
    with mp.workdps(digits + 3 * _SPARE):
        values = [mp.mpf(number) for number in numbers.values()]
        count = len(values) // 2
        beams = [*zip(values[:count], values[count:], strict=True)]
        p, step = mp.matrix([0, 0, 10]), mp.matrix([1, 1, 1])
        while mp.norm(step) > mp.mpf(10) ** -(digits + 5) * mp.norm(p):
            rows, residuals = [], []
            for height, passage in beams:
                root = mp.sqrt(p[1] ** 2 + 2 * p[2] * (p[0] + height))
                time = (root - p[1]) / p[2]
                rows.append([1 / root, -time / root, -(time**2) / (2 * root)])
                residuals.append(passage - time)
            step = mp.lu_solve(mp.matrix(rows), mp.matrix(residuals))
            p += step
        return _decimals(rise=p[0], speed=p[1], gravity=p[2])


def _decimals(**values: mpmath.mpf) -> Values:
    return {name: Decimal(mp.nstr(value, mp.dps)) for name, value in values.items()}
