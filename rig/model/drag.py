"""The discrete fall with drag proportional to the square of the speed.

The drag on a rod is c v²; the falling part of the chain then has the acceleration g − κ v², where
κ = Σc/Σm over the rods still falling. The free chain keeps all its rods and the first κ.

A leg of length d from speed v₀ to v₁, with q = e^(−2κd) and φ = (1 − q)/(2κd):

    v₁² = q v₀² + 2 g d φ
    t = τ atanh(x)/x,  τ = 2dφ/(v₁ + q v₀),  x = √(κg) τ

τ is (v₁ − v₀)/(g − κ v₀ v₁) with g − κ v₀² cancelled from both its parts, so nothing is lost at or
near the terminal speed √(g/κ), on either side of it. As x → 1 the time is taken instead from the
same expression as the sum κd + ln((v₁ + u)/(v₀ + u)), over √(κg), u being the terminal speed.
At κ = 0 every number is that of `rig.model.fall`.
"""

from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import lru_cache
from itertools import accumulate
from math import atanh, cos, exp, expm1, inf, log, log1p, radians, sinh, sqrt, tanh
from operator import mul

from rig.model.chain import Chain
from rig.model.fall import Fall, checked_fall
from rig.reasons import rig_error


def leg_drags(chain: Chain, drags: Sequence[float]) -> list[float]:
    """Return κ on the leg before each rod's impact, 1/m: Σc/Σm of that rod and all above it.

    Parameters
    ----------
    drags
        c of each rod, bottom up, not negative: drag force over speed squared, in units of mass/m.

    Returns
    -------
    list of float
        Shape ``(rods,)``, each correctly rounded: where all rods are alike so are all κ, and the
        two chains' difference is not touched by rounding (see `drag_fall`).
    """
    return [*_per_mass(tuple(drags), chain.masses)]


@lru_cache(maxsize=64)  # fractions are slow, and there are few chains
def _per_mass(drags: tuple[float, ...], masses: tuple[float, ...]) -> tuple[float, ...]:
    falling = [
        list(accumulate(map(Fraction, reversed(values))))[::-1] for values in (drags, masses)
    ]
    return tuple(float(drag / mass) for drag, mass in zip(*falling, strict=True))


def cylinder_drag(
    coefficient: float, density: float, diameter: float, length: float, tilt_deg: float
) -> float:
    """Return drag over speed squared of a rod that falls broadside, ½ ρ C d L cos³(tilt), kg/m.

    Only the flow across a tilted rod exerts a force: its squared speed has the factor cos², and the
    upward part of the force another cos (the cross-flow principle; S. F. Hoerner, Fluid-Dynamic
    Drag, 1965, chapter III). Shielding between rods is left out.

    Parameters
    ----------
    coefficient
        C of the cylinder across the flow: about 1.1 at the speeds of a lab.
    density
        ρ of the air, kg/m³.
    diameter, length
        Diameter and length of the rod, m.
    tilt_deg
        Tilt of the rod from horizontal, degrees.
    """
    return 0.5 * coefficient * density * diameter * length * cos(radians(tilt_deg)) ** 3


def drag_fall(
    chain: Chain,
    gains: Sequence[float],
    kappas: Sequence[float],
    drop: float,
    gravity: float,
    initial_speed: float = 0.0,
) -> Fall:
    """Return Δz, V and t of a fall in air; arguments as in `rig.model.fall`.

    Δz keeps full relative precision as α → 0 and as drags become equal: it is summed from the
    impacts' own effects and, where κ changes from leg to leg, from those of κ' − κ.

    Raises
    ------
    DomainError
        As `drag_leg`; or a speed leaves the range of floats.
    """
    gained = separation = time = 0.0
    speed = twin = initial_speed
    arrival, before, free = speed, -drop, kappas[0]
    for height, gain, kappa in zip(chain.heights, gains, kappas, strict=True):
        distance = height - before
        arrival, duration = drag_leg(distance, speed, gravity, kappa)
        time += duration
        grown, gained = _apart(gained, speed, twin, duration, gravity, free)
        separation += grown
        if kappa != free:
            # Up to here as if this chain had the free chain's drag.
            slowed = _behind(distance, duration, speed, gravity, kappa, free)
            separation += slowed[0]
            gained += slowed[1]
        twin = falling_speed(duration, gravity, free, twin)
        step = arrival * gain
        gained += step
        speed = arrival + step
        before = height
    return checked_fall(separation, arrival, time)


def drag_leg(distance: float, speed: float, gravity: float, kappa: float) -> tuple[float, float]:
    """Return the speed at the end of a leg in air, m/s, and the leg's duration, s.

    Raises
    ------
    DomainError
        The end is never reached, without gravity.
    """
    if distance == 0.0:
        return speed, 0.0
    decay = exp(-2.0 * kappa * distance)
    reach = 2.0 * distance * _per(expm1, -2.0 * kappa * distance)
    arrival = sqrt(speed * speed * decay + gravity * reach)
    if arrival == 0.0:
        raise rig_error("never_arrives")
    slow = reach / (arrival + decay * speed)
    rate = sqrt(kappa * gravity)
    if rate * slow < 0.5:
        return arrival, slow * _per(atanh, rate * slow)
    terminal = sqrt(gravity / kappa)  # where drag balances gravity
    return arrival, (kappa * distance + log((arrival + terminal) / (speed + terminal))) / rate


def fallen(time: float, gravity: float, kappa: float, initial_speed: float = 0.0) -> float:
    """Return the distance that a free chain has fallen after a time, m.

    ln(cosh x + r sinh x)/κ, with x = √(κg) t and r the initial speed over the terminal one.
    """
    rate = sqrt(kappa * gravity)
    x = rate * time
    if x <= 1.0:
        # (cosh x + r sinh x − 1)/κ, which is the distance without drag as κ → 0.
        half = time * _per(sinh, 0.5 * x)
        distance = 0.5 * gravity * half * half + initial_speed * time * _per(sinh, x)
        return distance * _per(log1p, kappa * distance)
    return (x + log1p(0.5 * (kappa * initial_speed / rate - 1.0) * -expm1(-2.0 * x))) / kappa


def falling_speed(time: float, gravity: float, kappa: float, initial_speed: float = 0.0) -> float:
    """Return the speed of a free chain after a time, m/s."""
    reach = time * _per(tanh, sqrt(kappa * gravity) * time)
    return (initial_speed + gravity * reach) / (1.0 + kappa * initial_speed * reach)


def _apart(
    gained: float, speed: float, twin: float, time: float, gravity: float, kappa: float
) -> tuple[float, float]:
    """Return the growth of the distance of two chains with equal κ, and their speed difference.

    From w = v − u at first: ln((C + κ v S)/(C + κ u S))/κ and w/((C + κ v S)(C + κ u S)), where
    C = cosh x, S = t sinh(x)/x and x = √(κg) t; both proportional to w, whatever it is.
    """
    x = sqrt(kappa * gravity) * time
    reach = time * _per(tanh, x)
    faster, slower = 1.0 + kappa * speed * reach, 1.0 + kappa * twin * reach
    parted = gained * reach / slower
    decay = exp(-2.0 * x)
    sech_squared = 4.0 * decay / ((1.0 + decay) * (1.0 + decay))
    return parted * _per(log1p, kappa * parted), gained * sech_squared / (faster * slower)


def _behind(
    distance: float, time: float, speed: float, gravity: float, kappa: float, free: float
) -> tuple[float, float]:
    """Return how far below a leg with the free chain's κ a leg ends, and how much faster.

    Both are proportional to κ' − κ. They are summed as series in time of v' = g − κ'v² and of the
    difference d of both speeds, d' = −(κ' − κ)v² − κ(2v − d)d.
    """
    if max(kappa, free) * distance > _SERIES_BELOW:
        # A plain difference loses no more digits than κ' − κ itself.
        return (
            distance - fallen(time, gravity, free, speed),
            falling_speed(time, gravity, kappa, speed) - falling_speed(time, gravity, free, speed),
        )
    speeds, faster, way, pull = [speed], [0.0], 0.0, gravity
    last = inf
    while len(faster) < 5 or abs(last) + abs(faster[-1]) > 1e-17 * abs(sum(faster)):
        last = faster[-1]
        square = sum(map(mul, speeds, reversed(speeds)))
        mixed = sum(
            (2.0 * v - d) * e for v, d, e in zip(speeds, faster, reversed(faster), strict=True)
        )
        scale = time / len(speeds)
        speeds.append((pull - kappa * square) * scale)
        faster.append(-((kappa - free) * square + free * mixed) * scale)
        way += faster[-1] * time / len(speeds)
        pull = 0.0
    return way, sum(faster)


_SERIES_BELOW = 0.4
"""κd up to which the series are summed; they converge well below π/2."""


def _per(function: Callable[[float], float], x: float) -> float:
    """Return f(x)/x of a function whose slope at 0 is 1; 1 at 0."""
    return function(x) / x if x else 1.0
