"""Predictions with uncertainty for one chain on one surface."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

from rig.errors import DomainError
from rig.measurands import FALL_TIME, SEPARATION, SPEED
from rig.model.chain import Chain
from rig.model.fall import Fall, air_legs, fall, kicks
from rig.model.impact import MU, impact_on, stated_coefficients, with_coefficients
from rig.model.prediction import PredictedIncline
from rig.model.surface import Surface
from rig.units import Quantity

AT_REST = Quantity(0.0)
ENDS = {SEPARATION: "separation_m", SPEED: "speed_m_s", FALL_TIME: "time_s"}
"""What is predicted, and where a `Fall` has it."""
LEAST = {MU: 0.0}
"""Coefficients that cannot be below a value."""


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
) -> PredictedIncline:
    """Predict Δz, V and t at one incline by the discrete model (Eqs. 8 to 13).

    Parameters
    ----------
    initial_speed
        Downward speed of both chains at release, m/s.
    kappas
        κ on the leg before each impact, 1/m, as from `rig.model.drag.leg_drags`; empty without
        air.
    drag_u
        Relative standard uncertainty common to all κ.

    Notes
    -----
    Uncertainties are first order: each input is changed by ± its standard uncertainty, or by less
    on the side where its possible range ends.
    """
    start, pull, height = initial_speed.value, gravity.value, max(0.0, drop.value + chain.length)
    free_speed, _ = air_legs(kappas)(height, start, pull, 0)
    air = ", drag" if kappas else ""
    result = PredictedIncline(
        incline_deg=incline_deg,
        model=f"discrete{air}",
        free_fall_speed_m_s=free_speed,
        in_domain=False,
        notes=[],
    )
    try:
        _check_order(chain, drop.value)
        impact = impact_on(surface, chain, incline_deg)
    except DomainError as error:
        return replace(result, notes=[error.message])
    release = {"drop": drop.value, "gravity": pull, "speed": start}
    centre = {"alpha": impact.alpha, "drag": 1.0, **release}

    def fall_with(**moved: float) -> Fall:
        alpha, drag, *place = (centre | moved).values()
        if not kappas:
            return fall(chain, alpha, impact.gamma, *place)
        from rig.model.drag import drag_fall  # noqa: PLC0415 - only where there is air

        gains = kicks(chain, [alpha] * chain.rods, impact.gamma)
        return drag_fall(chain, gains, [drag * kappa for kappa in kappas], *place)

    end, notes = fall_with(), [*impact.notes]
    values: dict[str, Any] = {row.name: getattr(end, name) for row, name in ENDS.items()}
    moves = {
        "alpha": _moved_alphas(chain, surface, incline_deg),
        "drop": steps(drop, least=0.0),
        # g is not reduced below half: a fall without gravity has no end.
        "gravity": steps(gravity, least=pull / 2),
        "speed": steps(initial_speed, least=0.0),
        "drag": steps(Quantity(1.0, drag_u), least=0.0),
    }
    try:
        spread = [
            (fall_with(**{name: low}), fall_with(**{name: high}), weight)
            for name, ends in moves.items()
            for low, high, weight in ends
        ]
    except DomainError as error:
        notes.append(f"no uncertainty: within that of μ, {error.message}")
    else:
        for row, name in ENDS.items():
            slopes = ((getattr(b, name) - getattr(a, name)) * weight for a, b, weight in spread)
            values[row.key("u")] = math.hypot(*slopes)
    if impact.basis == "pile":
        notes.append("rods gather on a pile: taken as level with the pile's restitution")
    basis = "" if impact.basis in {"surface", "level"} else f", {impact.basis}"
    return replace(
        result,
        model=f"discrete{basis}{air}",
        alpha=impact.alpha,
        gamma=impact.gamma,
        in_domain=not impact.notes,
        notes=notes,
        **values,
    )


def _check_order(chain: Chain, drop_m: float) -> None:
    """Raise an error unless rods strike after the release, and from the bottom up."""
    if min([drop_m, *(gap for gap, _ in chain.legs)]) < 0.0:
        raise DomainError(
            "a rod touches the surface before the release or before a lower rod",
            "release the chain higher, or make the surface less steep",
        )


def expected_alpha(chain: Chain, surface: Surface, incline_deg: float) -> Quantity:
    """Return α, with its uncertainty from those of chain and surface.

    Raises
    ------
    DomainError
        Eq. 13 has no finite solution within the uncertainty of μ.
    """
    impact = impact_on(surface, chain, incline_deg)
    ends = _moved_alphas(chain, surface, incline_deg)
    return Quantity(impact.alpha, math.hypot(*((b - a) * weight for a, b, weight in ends)))


def _moved_alphas(
    chain: Chain, surface: Surface, incline_deg: float
) -> Iterator[tuple[float, float, float]]:
    """Yield α with each coefficient changed down and up, and the weight."""
    for _, low, high, weight in moved_coefficients(surface, chain, incline_deg):
        yield impact_on(*low, incline_deg).alpha, impact_on(*high, incline_deg).alpha, weight


def moved_coefficients(
    surface: Surface, chain: Chain, incline_deg: float
) -> Iterator[tuple[str, tuple[Surface, Chain], tuple[Surface, Chain], float]]:
    """Yield the name of each input of α, the scene with it changed down and up, and the weight.

    The weight is u over the distance between both values; exact inputs are left out.
    """
    for name, stated in stated_coefficients(surface, chain, incline_deg).items():
        for *ends, weight in steps(stated, LEAST.get(name, -math.inf)):
            low, high = (with_coefficients(surface, chain, {name: end}) for end in ends)
            yield name, low, high, weight


def steps(quantity: Quantity, least: float = -math.inf) -> Iterator[tuple[float, float, float]]:
    """Yield an input changed down (not below `least`) and up by u, and the weight, unless exact."""
    low, high = max(least, quantity.value - quantity.u), quantity.value + quantity.u
    if high > low:
        yield low, high, quantity.u / (high - low)
