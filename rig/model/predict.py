"""Predictions with uncertainty for one chain on one surface."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

from rig.errors import DomainError
from rig.measurands import FALL_TIME, SEPARATION, SPEED
from rig.model.chain import Chain
from rig.model.fall import Fall, air_legs, fall, kicks
from rig.model.impact import ALPHA, MU, impact_on, stated_coefficients, with_coefficients
from rig.model.prediction import PredictedIncline
from rig.model.surface import Surface
from rig.reasons import rig_error
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
        if min([drop.value, *(gap for gap, _ in chain.legs)]) < 0.0:
            raise rig_error("rods_not_in_turn")
        impact = impact_on(surface, chain, incline_deg)
    except DomainError as error:
        return replace(result, notes=[error.message])
    release = {"drop": drop.value, "gravity": pull, "speed": start}
    centre = {ALPHA: impact.alpha, "drag": 1.0, **release}

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
        "drop": steps(drop, least=0.0),
        # g is not reduced below half: a fall without gravity has no end.
        "gravity": steps(gravity, least=pull / 2),
        "speed": steps(initial_speed, least=0.0),
        "drag": steps(Quantity(1.0, drag_u), least=0.0),
    }

    def changes(moved: str, low: float, high: float, weight: float) -> dict[str, float]:
        before, after = fall_with(**{moved: low}), fall_with(**{moved: high})
        return {
            row.name: (getattr(after, name) - getattr(before, name)) * weight
            for row, name in ENDS.items()
        }

    slopes: dict[str, dict[str, float]] = {}
    try:
        for name, *ends in _moved_alphas(chain, surface, incline_deg):
            slopes[name] = changes(ALPHA, *ends)
        of_release = [changes(name, *ends) for name, pairs in moves.items() for ends in pairs]
    except DomainError as error:
        notes.append(f"no uncertainty: within that of μ, {error.message}")
    else:
        all_changes = [*slopes.values(), *of_release]
        for row in ENDS:
            values[row.key("u")] = math.hypot(*(change[row.name] for change in all_changes))
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
        slopes=slopes,
        **values,
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
    return Quantity(impact.alpha, math.hypot(*((b - a) * weight for _, a, b, weight in ends)))


def _moved_alphas(
    chain: Chain, surface: Surface, incline_deg: float
) -> Iterator[tuple[str, float, float, float]]:
    """Yield each input of α, α with it changed down and up, and the weight, unless exact.

    The weight is u over the distance between both values.
    """
    for name, stated in stated_coefficients(surface, chain, incline_deg).items():
        for *ends, weight in steps(stated, LEAST.get(name, -math.inf)):
            scenes = (with_coefficients(surface, chain, {name: end}) for end in ends)
            low, high = (impact_on(*scene, incline_deg).alpha for scene in scenes)
            yield name, low, high, weight


def steps(quantity: Quantity, least: float = -math.inf) -> Iterator[tuple[float, float, float]]:
    """Yield an input changed down (not below `least`) and up by u, and the weight, unless exact."""
    low, high = max(least, quantity.value - quantity.u), quantity.value + quantity.u
    if high > low:
        yield low, high, quantity.u / (high - low)
