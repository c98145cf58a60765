"""The scenes of the precision benchmark, and what is true in each of them to 50 digits.

Every model has a reference of its own: discrete rods, the continuum, and impacts that last. All
take floats at their exact value, keep no digits by care, since there are plenty, and know nothing
of how `rig.model` computes: times are (V' − V)/g or closed forms, Δz is a difference of heights.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from decimal import Decimal
from itertools import accumulate
from typing import TYPE_CHECKING, Literal, NamedTuple

import mpmath
from mpmath import mp

from rig.bench.extremes import decades, uniform
from rig.bench.reference import exact_fall
from rig.model import paper
from rig.model.fall import kicks
from rig.model.impact import impact_on

if TYPE_CHECKING:
    from rig.model.chain import Chain

DIGITS = 50
_SPARE = 30  # lost to differences; x³ of a leg that is short against the contact time is the worst
GATE_M = 0.025
"""Of the gate above the contact point, m."""
CONTACT_TIMES = (1e-3, 1e-6, 1e-9)
"""s."""

Model = Literal["discrete", "continuum", "contact"]


@dataclass(frozen=True, slots=True)
class PrecisionScene:
    """One chain on one surface.

    Attributes
    ----------
    name
        For file names.
    title
        For people.
    alpha, gamma
        Impact coefficients of Eq. 9, taken as given by every method and every reference.
    even
        Whether Eq. 14 applies: like rods at equal distances.
    contact_times
        For which impacts that last are worked out, longest first, s.
    drop, gravity
        m and m/s².
    """

    name: str
    title: str
    chain: Chain
    alpha: float
    gamma: float
    even: bool
    contact_times: tuple[float, ...] = CONTACT_TIMES
    drop: float = paper.DROP
    gravity: float = paper.GRAVITY

    @property
    def spacing_m(self) -> float:
        """Distance between rods, s of Eq. 11."""
        return self.chain.length / (self.chain.rods - 1)

    @property
    def gains(self) -> list[float]:
        """ΔV/V of each impact."""
        return kicks(self.chain, [self.alpha] * self.chain.rods, self.gamma)


class ExactAnswer(NamedTuple):
    """Δz (m), V (m/s) and when the top rod is `GATE_M` above the contact point (s)."""

    separation: Decimal
    speed: Decimal
    gate: Decimal


def scenes() -> tuple[PrecisionScene, ...]:
    """All four, all at 40° on the paper's surface."""
    return (
        scene("uniform", "25 uniform rods at 40°", paper.UNIFORM, even=True),
        scene("graded", "graded chain at 40°", paper.graded(), even=False),
        scene("rods-10000", "10,000 uniform rods", uniform(10_000), even=True),
        scene("exponential", "25 rods, mass over 12 decades", decades(-12.0), even=False),
    )


def scene(
    name: str, title: str, chain: Chain, *, even: bool, incline_deg: float = paper.MIDDLE_INCLINE
) -> PrecisionScene:
    """Put a chain on the paper's surface."""
    impact = impact_on(paper.BARE, chain, incline_deg)
    return PrecisionScene(name, title, chain, impact.alpha, impact.gamma, even)


def discrete_truth(scene: PrecisionScene) -> ExactAnswer:
    """Rod by rod, Eq. 9 and free fall; at the gate, the fall of the chain as far as it struck."""
    chain = scene.chain
    coefficients = [Decimal(scene.alpha)] * chain.rods, [Decimal(scene.gamma)] * chain.rods
    where = scene.drop, scene.gravity
    end = exact_fall(chain.masses, chain.heights, *coefficients, *where)
    gate = chain.length - GATE_M
    struck = sum(height < gate for height in chain.heights)
    masses = (*chain.masses[:struck], math.fsum(chain.masses[struck:]))
    passing = exact_fall(masses, (*chain.heights[:struck], gate), *coefficients, *where)
    return ExactAnswer(end.separation, end.speed, passing.time)


def contact_truth(scene: PrecisionScene, contact_time: float) -> ExactAnswer:
    """Impacts that last: pull ΔV·(t/τ'²)·exp(−t/τ') each, τ' = τ/2, leg by leg in closed form.

    Parameters
    ----------
    contact_time
        τ, s.
    """
    with mp.workdps(DIGITS + _SPARE):
        g, tau = mp.mpf(scene.gravity), mp.mpf(contact_time) / 2
        time = gate = mp.mpf(0)
        speed = first = second = mp.mpf(0)  # the last two in units of speed still to come
        before = -mp.mpf(scene.drop)
        enough = mp.mpf(10) ** -(DIGITS // 2 + 10)  # the step itself doubles the digits
        for height, gain in _stops(scene):
            distance = height - before
            before = height
            leg = 2 * distance / (speed + mp.sqrt(speed**2 + 2 * g * distance))
            step = leg
            # The way is convex in time and no leg is longer than free fall: Newton from above.
            while abs(step) > enough * leg:
                x = leg / tau
                ahead = mp.exp(-x)
                extra_way = first * (x - 2 + (2 + x) * ahead) + second * (x - 1 + ahead)
                grown = first * (1 - (1 + x) * ahead) + second * (1 - ahead)
                fallen = (speed + g * leg / 2) * leg + tau * extra_way
                step = (fallen - distance) / (speed + g * leg + grown)
                leg -= step
            x = leg / tau
            ahead = mp.exp(-x)
            speed += g * leg + first * (1 - (1 + x) * ahead) + second * (1 - ahead)
            second = (second + first * x) * ahead
            first *= ahead
            time += leg
            if gain is None:
                gate = time
            else:
                first += speed * gain
        return _truth(_separation(scene, time), speed, gate)


def continuum_truth(scene: PrecisionScene) -> ExactAnswer:
    """Eq. 14, and the time from one height down to another by S15.

    With v = ((z + γs)/(z₀ + γs))^(1+2α), S15 is ∫ v^(b−1) (c − d v)^(−1/2) dv, b = (1+α)/(1+2α): a
    hypergeometric function.
    """
    with mp.workdps(DIGITS + _SPARE):
        z0, h, g = mp.mpf(scene.chain.length), mp.mpf(scene.drop), mp.mpf(scene.gravity)
        reach, alpha = mp.mpf(scene.gamma) * mp.mpf(scene.spacing_m), mp.mpf(scene.alpha)
        power = 1 + 2 * alpha
        reach_above = z0 + reach
        b, d = (1 + alpha) / power, 2 * g * reach_above / power
        c = 2 * g * h + d

        def fallen(z: mpmath.mpf) -> mpmath.mpf:
            v = ((z + reach) / reach_above) ** power
            primitive = v**b / b * mp.hyp2f1(mp.mpf(1) / 2, b, b + 1, v * d / c)
            return -reach_above / power / mp.sqrt(c) * primitive

        strike = mp.sqrt(2 * h / g)
        gate = strike + fallen(mp.mpf(GATE_M)) - fallen(z0)
        end = strike + fallen(mp.mpf(0)) - fallen(z0)
        braces = h * reach_above ** (2 * alpha) + (reach_above**power - reach**power) / power
        speed = mp.sqrt(2 * g * braces / reach ** (2 * alpha))
        return _truth(_separation(scene, end), speed, gate)


def _stops(scene: PrecisionScene) -> list[tuple[mpmath.mpf, mpmath.mpf | None]]:
    """Heights of the rods with their gains ΔV/V, and of the gate with None, in rising order."""
    masses = [mp.mpf(mass) for mass in scene.chain.masses]
    above = [*accumulate(reversed(masses[1:]))][::-1]
    alpha, gamma = mp.mpf(scene.alpha), mp.mpf(scene.gamma)
    gains = [alpha * m / (M + gamma * m) for m, M in zip(masses, above, strict=False)]
    heights = [mp.mpf(height) for height in scene.chain.heights]
    stops: list[tuple[mpmath.mpf, mpmath.mpf | None]] = [
        *zip(heights, [*gains, mp.mpf(0)], strict=True),
        (heights[-1] - mp.mpf(GATE_M), None),
    ]
    return sorted(stops, key=lambda stop: stop[0])


def _separation(scene: PrecisionScene, time: mpmath.mpf) -> mpmath.mpf:
    """How far free fall from rest still is above the contact point, m."""
    top = mp.mpf(scene.drop) + mp.mpf(scene.chain.heights[-1])
    return top - mp.mpf(scene.gravity) * time**2 / 2


def _truth(separation: mpmath.mpf, speed: mpmath.mpf, gate: mpmath.mpf) -> ExactAnswer:
    return ExactAnswer(*(Decimal(mp.nstr(value, DIGITS)) for value in (separation, speed, gate)))
