"""Predictions with uncertainty for one chain on one surface."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from rig.errors import DomainError
from rig.model.fall import Fall, fall, free_fall, kicks
from rig.model.impact import Impact, impact_on
from rig.units import Quantity

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from rig.model.chain import Chain
    from rig.model.surface import Surface

AT_REST = Quantity(0.0)


@dataclass(frozen=True, slots=True)
class Prediction:
    """What the discrete model says of one scene.

    Attributes
    ----------
    model
        ``discrete`` and what α rests on; ``drag`` where there is air.
    alpha, gamma, separation, speed, time
        `None` where the model has no answer; `notes` says why.
    separation_u, speed_u, time_u
        Standard uncertainties that follow from those of β, μ (or α), drop, gravity, initial speed
        and drag; `None` also where Eq. 13 is singular within the uncertainty of μ.
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
    time_u: float | None = None


class _Inputs(NamedTuple):
    """Everything a fall follows from, once the chain is known."""

    alpha: float
    gamma: float
    drop: float
    gravity: float
    speed: float
    drag: float  # times what is given


def predict(
    chain: Chain,
    surface: Surface,
    incline_deg: float,
    drop: Quantity,
    gravity: Quantity,
    *,
    initial_speed: Quantity = AT_REST,
    kappas: Sequence[float] = (),
    drag_u: float = 0.0,
) -> Prediction:
    """Predict Δz, V and t at one incline by the discrete model (Eqs. 8 to 13).

    Parameters
    ----------
    initial_speed
        Of both chains at release, downward, m/s.
    kappas
        κ on the leg before each impact, 1/m, as from `rig.model.drag.leg_drags`; empty without
        air.
    drag_u
        Relative standard uncertainty common to them.

    Notes
    -----
    Uncertainties are first order: each input is moved by ± its standard uncertainty, or, where
    that would leave what is possible, by less and to one side; the slope counts either way.
    """
    free, drops = _ways_down(chain, kappas)
    free_speed = free(drop.value, gravity.value, initial_speed.value)
    air = ", drag" if kappas else ""
    try:
        impact = impact_on(surface, chain, incline_deg)
    except DomainError as error:
        return Prediction(
            incline_deg, f"discrete{air}", free_speed, in_domain=False, notes=(error.message,)
        )
    inputs = _Inputs(
        impact.alpha, impact.gamma, drop.value, gravity.value, initial_speed.value, 1.0
    )
    centre = drops(inputs)
    notes = impact.notes
    separation_u = speed_u = time_u = None
    moved = {
        "alpha": _moved_alphas(chain, surface, impact, incline_deg),
        "drop": _steps(drop, least=0.0),
        # Half of g is far enough for a slope, and a fall without gravity has no end.
        "gravity": _steps(gravity, least=gravity.value / 2),
        "speed": _steps(initial_speed, least=0.0),
        "drag": _steps(Quantity(1.0, drag_u), least=0.0),
    }
    try:
        spread = [
            (drops(inputs._replace(**{name: low})), drops(inputs._replace(**{name: high})), weight)
            for name, steps in moved.items()
            for low, high, weight in steps
        ]
    except DomainError as error:
        notes = (*notes, f"no uncertainty: within that of μ, {error.message}")
    else:
        separation_u = math.hypot(*((b.separation_m - a.separation_m) * w for a, b, w in spread))
        speed_u = math.hypot(*((b.speed_m_s - a.speed_m_s) * w for a, b, w in spread))
        time_u = math.hypot(*((b.time_s - a.time_s) * w for a, b, w in spread))
    if impact.basis == "pile":
        notes = (*notes, "rods gather on a pile: taken as level with the pile's restitution")
    return Prediction(
        incline_deg,
        ("discrete" if impact.basis in {"surface", "level"} else f"discrete, {impact.basis}") + air,
        free_speed,
        in_domain=not impact.notes,
        notes=notes,
        alpha=impact.alpha,
        gamma=impact.gamma,
        separation=centre.separation_m,
        speed=centre.speed_m_s,
        time=centre.time_s,
        separation_u=separation_u,
        speed_u=speed_u,
        time_u=time_u,
    )


def _ways_down(
    chain: Chain, kappas: Sequence[float]
) -> tuple[Callable[[float, float, float], float], Callable[[_Inputs], Fall]]:
    """The speed of free fall from drop, gravity and initial speed; the fall from its inputs."""
    if not kappas:
        return (
            lambda drop, gravity, speed: free_fall(chain, drop, gravity, speed)[0],
            lambda x: fall(chain, x.alpha, x.gamma, x.drop, x.gravity, x.speed),
        )
    from rig.model.drag import drag_fall, drag_leg  # noqa: PLC0415 - only where there is air

    def in_air(x: _Inputs) -> Fall:
        gains = kicks(chain, [x.alpha] * chain.rods, x.gamma)
        scaled = [x.drag * kappa for kappa in kappas]
        return drag_fall(chain, gains, scaled, x.drop, x.gravity, x.speed)

    return (
        lambda drop, gravity, speed: drag_leg(drop + chain.length, speed, gravity, kappas[0])[0],
        in_air,
    )


def expected_alpha(chain: Chain, surface: Surface, incline_deg: float) -> Quantity:
    """α of all rods together, with what the uncertainties of chain and surface make of it.

    Raises
    ------
    DomainError
        Where Eq. 13 has no finite solution, or none within the uncertainty of μ.
    """
    impact = impact_on(surface, chain, incline_deg)
    steps = _moved_alphas(chain, surface, impact, incline_deg)
    return Quantity(impact.alpha, math.hypot(*((b - a) * weight for a, b, weight in steps)))


def _moved_alphas(
    chain: Chain, surface: Surface, impact: Impact, incline_deg: float
) -> Iterator[tuple[float, float, float]]:
    """α with each of what it rests on moved down and up, and the weight."""
    if chain.alpha is not None:
        yield from _steps(chain.alpha)
        return
    struck = surface.pile if impact.basis == "pile" and surface.pile else surface
    for *ends, weight in _steps(struck.restitution):
        low, high = (
            impact_on(surface, chain, incline_deg, restitution=beta).alpha for beta in ends
        )
        yield low, high, weight
    if impact.basis == "surface":
        for *ends, weight in _steps(surface.friction, least=0.0):
            low, high = (impact_on(surface, chain, incline_deg, friction=mu).alpha for mu in ends)
            yield low, high, weight


def _steps(quantity: Quantity, least: float = -math.inf) -> Iterator[tuple[float, float, float]]:
    """An input moved down and up by u, not below `least`; nothing where it is exact."""
    low, high = max(least, quantity.value - quantity.u), quantity.value + quantity.u
    if high > low:
        yield low, high, quantity.u / (high - low)
