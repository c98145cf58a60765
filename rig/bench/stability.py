"""How the model fares at the ends of what can be asked, against 50 digits."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from decimal import Decimal

from rig.bench.extremes import PITCH, Extreme, extremes
from rig.bench.reference import Exact, exact_coefficients, exact_fall
from rig.errors import DomainError
from rig.model.chain import Chain
from rig.model.drag import drag_fall
from rig.model.fall import Fall, fall, kicks
from rig.model.impact import Impact, impact_on
from rig.model.surface import Surface
from rig.units import Quantity

SOUND = 343.0
"""Speed of sound in air at 20 °C, m/s."""


@dataclass(frozen=True, slots=True)
class StabilityRow:
    """One line of the table.

    Attributes
    ----------
    separation_error, speed_error
        Relative, against 50 digits; `None` where the model refuses.
    verdict
        ``exact``, ``noted`` (outside the domain, and said so), ``refused`` (a clear error), or
        ``FAILED``.
    note
        The domain note or error, word for word.
    naive
        What becomes of the same scene when it is evaluated as the equations are printed.
    """

    group: str
    value: str
    separation_error: float | None
    speed_error: float | None
    verdict: str
    note: str
    naive: str


def stability(progress: Callable[[StabilityRow], None] | None = None) -> list[StabilityRow]:
    """Try every scene of `rig.bench.extremes.extremes`.

    Parameters
    ----------
    progress
        Told each row as it is done.
    """
    rows = []
    for scene in extremes():
        row = examine(scene)
        rows.append(row)
        if progress is not None:
            progress(row)
    return rows


def examine(scene: Extreme) -> StabilityRow:
    """Try one scene; a warning counts as a failure."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            impact = _impact(scene)
            result = _fall(scene, impact)
        except DomainError as error:
            return StabilityRow(scene.group, scene.value, None, None, "refused", error.message, "–")
        except (ArithmeticError, ValueError, Warning) as error:
            words = f"{type(error).__name__}: {error}"
            return StabilityRow(scene.group, scene.value, None, None, "FAILED", words, "–")
    exact = _exact(scene)
    separation = relative_error(result.separation_m, exact.separation)
    speed = relative_error(result.speed_m_s, exact.speed)
    good = max(separation, speed) <= scene.allowed
    verdict = "FAILED" if not good else "noted" if impact.notes else "exact"
    note = "; ".join(impact.notes)
    return StabilityRow(
        scene.group, scene.value, separation, speed, verdict, note, _naive(scene, impact, exact)
    )


def relative_error(result: float, exact: Decimal) -> float:
    """|found/exact − 1|; infinite where found is no number, 0 where no float is nearer."""
    if result == float(exact):
        return 0.0
    if not math.isfinite(result) or exact == 0:
        return math.inf
    return float(abs(Decimal(result) / exact - 1))


def _fall(scene: Extreme, impact: Impact) -> Fall:
    chain, where = scene.chain, (scene.drop, scene.gravity, scene.initial_speed)
    if not scene.kappa:
        return fall(chain, impact.alpha, impact.gamma, *where)
    gains = kicks(chain, [impact.alpha] * chain.rods, impact.gamma)
    return drag_fall(chain, gains, [scene.kappa] * chain.rods, *where)


def _impact(scene: Extreme) -> Impact:
    chain = scene.chain
    if scene.alpha is not None:
        gamma = impact_on(scene.surface, chain, 0.0).gamma
        chain = replace(chain, alpha=Quantity(scene.alpha), gamma=gamma)
    return impact_on(scene.surface, chain, scene.incline_deg)


def _exact(scene: Extreme) -> Exact:
    chain = scene.chain
    alpha, gamma = exact_coefficients(
        scene.restitution, scene.friction, scene.incline_deg, chain.inertia, chain.inertia_z
    )
    if scene.alpha is not None:
        alpha = Decimal(scene.alpha)
    body = chain.masses, chain.heights, [alpha] * chain.rods, [gamma] * chain.rods
    return exact_fall(*body, scene.drop, scene.gravity, scene.initial_speed, scene.kappa)


def _naive(scene: Extreme, impact: Impact, exact: Exact) -> str:
    """Evaluate as printed: times as (V' − V)/g, Δz as a difference of heights, J before J/M."""
    chain, g = scene.chain, scene.gravity
    if scene.kappa:
        return "without air"
    try:
        mass = sum(chain.masses)
        time, speed, before = 0.0, scene.initial_speed, -scene.drop
        arrival = speed
        for k, height in enumerate(chain.heights):
            arrival = math.sqrt(speed**2 + 2 * g * (height - before))
            time += (arrival - speed) / g
            mass -= chain.masses[k]
            if k < chain.rods - 1:
                m = chain.masses[k]
                speed = arrival + impact.alpha * m * arrival / (1 + impact.gamma * m / mass) / mass
            before = height
        top = scene.drop + chain.heights[-1]
        separation = top - scene.initial_speed * time - 0.5 * g * time**2
    except ArithmeticError as error:
        return type(error).__name__
    errors = relative_error(separation, exact.separation), relative_error(arrival, exact.speed)
    return f"{errors[0]:.0e} {errors[1]:.0e}"


@dataclass(frozen=True, slots=True)
class Sonic:
    """How long a chain must be for its end to break the speed of sound.

    Attributes
    ----------
    ratio
        Mass of each rod over that of the rod below.
    rods, length_m, decades
        Of the shortest such chain, and by how many powers of ten its mass per rod falls.
    """

    ratio: float
    rods: int
    length_m: float
    decades: float


def sonic_lengths(ratios: Iterable[float] = (0.9, 0.7, 0.5, 0.3)) -> list[Sonic]:
    """Find the shortest chains that end faster than sound, on a hard level surface without air.

    Rods are `PITCH` apart and fall 18 cm before the first impact, as in the paper.
    """
    result = []
    for ratio in ratios:
        low, high = 2, 4
        while _end_speed(ratio, high) < SOUND:
            low, high = high, 2 * high
        while high - low > 1:
            middle = (low + high) // 2
            if _end_speed(ratio, middle) < SOUND:
                low = middle
            else:
                high = middle
        result.append(Sonic(ratio, high, (high - 1) * PITCH, (high - 1) * -math.log10(ratio)))
    return result


def _end_speed(ratio: float, rods: int) -> float:
    chain = Chain(tuple(ratio**k for k in range(rods)), tuple(PITCH * k for k in range(rods)))
    impact = impact_on(Surface(Quantity(0.5)), chain, 0.0)
    return fall(chain, impact.alpha, impact.gamma, 0.18, 9.81).speed_m_s
