"""Impact coefficients α and γ of a rod chain (sections III.A to III.D and S V of the paper)."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

from rig.model.chain import UNIFORM_ROD_INERTIA, Chain
from rig.reasons import rig_error
from rig.units import Quantity

if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import TypeVar

    from rig.arrays import Array
    from rig.model.surface import Surface

    Number = TypeVar("Number", float, Array)

ALPHA, BETA, MU, PILE = "alpha", "restitution", "friction", "pile_restitution"
"""Names of the coefficients that a protocol states."""
_BASES = {(ALPHA,): "given", (PILE,): "pile", (BETA,): "level", (BETA, MU): "surface"}


class Impact(NamedTuple):
    """Coefficients of a rod's impulse on the chain above, J = α m V / (1 + γ m/M), Eq. 9.

    Attributes
    ----------
    alpha, gamma
        The coefficients of Eq. 9.
    basis
        Origin of α: ``surface``, ``level``, ``pile`` or ``given``.
    notes
        All departures from the model's domain; empty inside it.
    """

    alpha: float
    gamma: float
    basis: str
    notes: tuple[str, ...] = ()


def alpha_level(restitution: Number, inertia: Number | float = UNIFORM_ROD_INERTIA) -> Number:
    """Return α of a long chain on a level surface, Eq. 8; or of lift-off, N = αλV², Eq. S20.

    At lift-off the surface pushes on a rod that is pulled up by an end, and `restitution` is β'
    between rod and chain through the string: 0 if the string damps all bouncing.
    """
    return (1.0 + restitution) / 4.0 * (1.0 - inertia)


def alpha_inclined(
    restitution: float,
    friction: float,
    incline_deg: float,
    inertia: float = UNIFORM_ROD_INERTIA,
    inertia_z: float | None = None,
) -> float:
    """Return α of a long chain on an inclined surface, Eqs. 12 and 13.

    `inertia` is ξ_y and `inertia_z` is ξ_z, the same unless given. Eq. 13 is multiplied through
    by cos θ + μ sin θ, so that cot θ at 0° and tan θ at 90° are never formed.

    Raises
    ------
    DomainError
        g(θ) ≤ 0: no finite impulse satisfies Eqs. S7 to S12.
    """
    sin = math.sin(math.radians(incline_deg))
    # Not cos θ: near 90° the rounding of θ in radians would dominate.
    cos = math.sin(math.radians(90.0 - incline_deg))
    if cos == 0.0:
        return 0.0  # a wall: the contact has no vertical part
    g = contact_share(sin, cos, friction, gamma_finite(inertia, inertia_z))
    if g <= 0.0:
        inputs = {"incline_deg": incline_deg, "friction": friction, "inertia": inertia}
        raise rig_error("eq13_singular", **inputs)
    return alpha_level(restitution, inertia) * cos / g


def contact_share(sin: Number, cos: Number, friction: Number, free_rod: Number) -> Number:
    """Return g(θ) of Eq. 13 times cos θ + μ sin θ; `free_rod` is Eq. 10 of ξ_y and ξ_z."""
    return cos + free_rod * sin * (sin - friction * cos) / (cos + friction * sin)


def gamma_finite(inertia: Number, inertia_above: Number | None = None) -> Number:
    """Return γ, which reduces the tension near the chain's end, Eq. 10 (ξ' = ξ unless given)."""
    above = inertia if inertia_above is None else inertia_above
    return 0.25 * (1.0 + inertia) * (1.0 + 1.0 / above)


def stated_coefficients(surface: Surface, chain: Chain, incline_deg: float) -> dict[str, Quantity]:
    """Return the inputs of α by name: α itself, a pile's β, or β and, on an incline, μ."""
    if chain.alpha is not None:
        return {ALPHA: chain.alpha}
    if surface.pile is not None and incline_deg < surface.pile.below_deg:
        return {PILE: surface.pile.restitution}
    return {BETA: surface.restitution} | ({MU: surface.friction} if incline_deg else {})


def with_coefficients(
    surface: Surface, chain: Chain, values: Mapping[str, float]
) -> tuple[Surface, Chain]:
    """Return a surface and a chain with other coefficients, named as in `stated_coefficients`."""
    new: dict[str, Any] = {name: Quantity(value) for name, value in values.items()}
    if PILE in new and surface.pile is not None:
        surface = replace(surface, pile=replace(surface.pile, restitution=new[PILE]))
    surface = replace(surface, **{name: new[name] for name in (BETA, MU) if name in new})
    return surface, replace(chain, alpha=new[ALPHA]) if ALPHA in new else chain


def impact_on(surface: Surface, chain: Chain, incline_deg: float) -> Impact:
    """Return the coefficients for a chain on a surface, with all departures from the domain.

    Raises
    ------
    DomainError
        Eq. 13 has no finite solution.
    """
    gamma, notes = chain.gamma, []
    stated = stated_coefficients(surface, chain, incline_deg)
    basis, (first, *friction) = _BASES[tuple(stated)], [each.value for each in stated.values()]
    if basis == "given":
        alpha, gamma = first, gamma or 0.0
    elif not friction:
        alpha = alpha_level(first, chain.inertia)
    else:
        (mu,) = friction
        alpha = alpha_inclined(first, mu, incline_deg, chain.inertia, chain.inertia_z)
        sliding = math.degrees(math.atan(mu))
        if incline_deg < sliding:
            notes.append(
                f"the rod does not slide: incline {incline_deg:g}° is below arctan μ = "
                f"{sliding:.1f}°, so f = μN does not hold"
            )
    if alpha > 0.5:
        notes.append(f"α = {alpha:.4g} is above ½: more energy than the rod brings")
    if alpha < 0.0:
        notes.append(f"α = {alpha:.4g} is negative: the rod would push the chain up")
    gamma = gamma_finite(chain.inertia) if gamma is None else gamma
    return Impact(alpha, gamma, basis, tuple(notes))
