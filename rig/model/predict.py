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
        Standard uncertainties that follow from those of β, μ (or α), drop and gravity.
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

    Uncertainties are first order: each input is moved by ± its standard uncertainty.
    """
    vacuum = free_fall_speed(chain, drop.value, gravity.value)
    try:
        impact = impact_on(surface, chain, incline_deg)
    except DomainError as error:
        return Prediction(incline_deg, "discrete", vacuum, in_domain=False, notes=(error.message,))
    centre = fall(chain, impact.alpha, impact.gamma, drop.value, gravity.value)
    spread = list(_spread(chain, surface, impact, incline_deg, drop, gravity))
    notes = impact.notes
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
        separation_u=math.hypot(*((a.separation_m - b.separation_m) / 2 for a, b in spread)),
        speed_u=math.hypot(*((a.speed_m_s - b.speed_m_s) / 2 for a, b in spread)),
    )


def _spread(
    chain: Chain,
    surface: Surface,
    impact: Impact,
    incline_deg: float,
    drop: Quantity,
    gravity: Quantity,
) -> Iterator[tuple[Fall, Fall]]:
    """Falls with one input at a time moved down and up by its standard uncertainty."""
    h, g, gamma = drop.value, gravity.value, impact.gamma

    def at(alpha: float) -> Fall:
        return fall(chain, alpha, gamma, h, g)

    if chain.alpha is not None:
        a, u = chain.alpha.value, chain.alpha.u
        yield at(a - u), at(a + u)
    else:
        struck = surface.pile if impact.basis == "pile" and surface.pile else surface
        beta = struck.restitution
        if beta.u:
            low, high = (
                impact_on(surface, chain, incline_deg, restitution=beta.value + s * beta.u).alpha
                for s in (-1, 1)
            )
            yield at(low), at(high)
        mu = surface.friction
        if mu.u and impact.basis == "surface":
            low, high = (
                impact_on(surface, chain, incline_deg, friction=max(0.0, mu.value + s * mu.u)).alpha
                for s in (-1, 1)
            )
            yield at(low), at(high)
    if drop.u:
        low, high = max(0.0, h - drop.u), h + drop.u
        yield fall(chain, impact.alpha, gamma, low, g), fall(chain, impact.alpha, gamma, high, g)
    if gravity.u:
        yield (
            fall(chain, impact.alpha, gamma, h, g - gravity.u),
            fall(chain, impact.alpha, gamma, h, g + gravity.u),
        )
