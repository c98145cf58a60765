"""Predictions with uncertainty for one chain on one surface."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rig.errors import DomainError
from rig.model.fall import Fall, fall, free_fall_speed
from rig.model.impact import Impact, impact_on

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rig.model.chain import Chain
    from rig.model.surface import Surface
    from rig.units import Quantity


@dataclass(frozen=True, slots=True)
class Prediction:
    """What the discrete model says of one scene.

    Attributes
    ----------
    model
        ``discrete`` and what α rests on.
    alpha, gamma, separation, speed, time
        `None` where the model has no answer; `notes` says why.
    separation_u, speed_u
        Standard uncertainties that follow from those of β, μ (or α), drop and gravity; `None`
        also where Eq. 13 is singular within the uncertainty of μ.
    in_domain
        False when any note says that the case leaves the model's domain.
    """

    incline_deg: float
    model: str
    free_fall_speed: float
    in_domain: bool
    notes: tuple[str, ...]
    alpha: float | None = None
    gamma: float | None = None
    separation: float | None = None
    speed: float | None = None
    time: float | None = None
    separation_u: float | None = None
    speed_u: float | None = None


def predict(
    chain: Chain, surface: Surface, incline_deg: float, drop: Quantity, gravity: Quantity
) -> Prediction:
    """Predict Δz, V and t at one incline by the discrete model (Eqs. 8 to 13).

    Uncertainties are first order: each input is moved by ± its standard uncertainty, or, where
    that would leave what is possible, by less and to one side; the slope counts either way.
    """
    vacuum = free_fall_speed(chain, drop.value, gravity.value)
    try:
        impact = impact_on(surface, chain, incline_deg)
    except DomainError as error:
        return Prediction(incline_deg, "discrete", vacuum, in_domain=False, notes=(error.message,))
    centre = fall(chain, impact.alpha, impact.gamma, drop.value, gravity.value)
    notes = impact.notes
    separation_u = speed_u = None
    try:
        spread = list(_spread(chain, surface, impact, incline_deg, drop, gravity))
    except DomainError as error:
        notes = (*notes, f"no uncertainty: within that of μ, {error.message}")
    else:
        separation_u = math.hypot(*((b.separation_m - a.separation_m) * w for a, b, w in spread))
        speed_u = math.hypot(*((b.speed_m_s - a.speed_m_s) * w for a, b, w in spread))
    if impact.basis == "pile":
        notes = (*notes, "rods gather on a pile: taken as level with the pile's restitution")
    return Prediction(
        incline_deg,
        "discrete" if impact.basis in {"surface", "level"} else f"discrete, {impact.basis}",
        vacuum,
        in_domain=not impact.notes,
        notes=notes,
        alpha=impact.alpha,
        gamma=impact.gamma,
        separation=centre.separation_m,
        speed=centre.speed_m_s,
        time=centre.time_s,
        separation_u=separation_u,
        speed_u=speed_u,
    )


def _spread(
    chain: Chain,
    surface: Surface,
    impact: Impact,
    incline_deg: float,
    drop: Quantity,
    gravity: Quantity,
) -> Iterator[tuple[Fall, Fall, float]]:
    """Falls with one input at a time moved down and up, and u over the distance between them."""
    h, g, gamma = drop.value, gravity.value, impact.gamma

    def at(alpha: float) -> Fall:
        return fall(chain, alpha, gamma, h, g)

    if chain.alpha is not None:
        for low, high, weight in _steps(chain.alpha):
            yield at(low), at(high), weight
    else:
        struck = surface.pile if impact.basis == "pile" and surface.pile else surface
        for low, high, weight in _steps(struck.restitution):
            alphas = [
                impact_on(surface, chain, incline_deg, restitution=beta).alpha
                for beta in (low, high)
            ]
            yield at(alphas[0]), at(alphas[1]), weight
        if impact.basis == "surface":
            for low, high, weight in _steps(surface.friction, least=0.0):
                alphas = [
                    impact_on(surface, chain, incline_deg, friction=mu).alpha for mu in (low, high)
                ]
                yield at(alphas[0]), at(alphas[1]), weight
    for low, high, weight in _steps(drop, least=0.0):
        yield (
            fall(chain, impact.alpha, gamma, low, g),
            fall(chain, impact.alpha, gamma, high, g),
            weight,
        )
    # Half of g is far enough for a slope, and a fall without gravity has no end.
    for low, high, weight in _steps(gravity, least=g / 2):
        yield (
            fall(chain, impact.alpha, gamma, h, low),
            fall(chain, impact.alpha, gamma, h, high),
            weight,
        )


def _steps(given: Quantity, least: float = -math.inf) -> Iterator[tuple[float, float, float]]:
    """An input moved down and up by u, not below `least`; nothing where it is exact."""
    low, high = max(least, given.value - given.u), given.value + given.u
    if high > low:
        yield low, high, given.u / (high - low)
