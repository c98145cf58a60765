"""The parameters of which a sweep can make an axis, and which of them a scene has."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rig.errors import InputError
from rig.model.chain import XI
from rig.protocol.keys import Range, range_of

if TYPE_CHECKING:
    from rig.protocol.protocol import Protocol


@dataclass(frozen=True, slots=True)
class Variable:
    """One parameter.

    Attributes
    ----------
    accepted
        The values a protocol may give it.
    column
        Its name in a table, with the unit.
    label
        What stands at an axis.
    """

    accepted: Range
    column: str
    label: str


VARIABLES = {
    "incline": Variable(range_of("plan.incline"), "incline_deg", "inclination of the surface (°)"),
    "restitution": Variable(range_of("surface.restitution"), "restitution", "restitution β"),
    "friction": Variable(range_of("surface.friction"), "friction", "friction μ"),
    "inertia": Variable(
        range_of("chains.*.inertia"), "inertia", "moment of inertia of the rods, I/(m L²)"
    ),
    "alpha": Variable(range_of("chains.*.alpha"), "alpha", "impact coefficient α"),
    "gamma": Variable(range_of("chains.*.gamma"), "gamma", "impact coefficient γ"),
    "drop": Variable(range_of("drop"), "drop_m", "drop (m)"),
    "initial_speed": Variable(
        range_of("initial_speed"), "initial_speed_m_s", "initial speed (m/s)"
    ),
    "gravity": Variable(range_of("gravity"), "gravity_m_s2", "gravity (m/s²)"),
}


def scene_values(protocol: Protocol) -> dict[str, tuple[float, ...]]:
    """Return what the striking chain's fall depends on, each with the scene's own value.

    Only the incline may have several values, those of the plan. Where the protocol states α, the
    surface's coefficients play no part and are left out; γ and the initial speed are there where
    the protocol states them.

    Raises
    ------
    InputError
        If nothing is struck in this scene, or it has air.
    """
    if protocol.surface is None:
        raise InputError(
            f"{protocol.source}: the scene has no surface, so there is no impact to map",
            "name a protocol with a surface",
        )
    if protocol.drag is not None:
        raise InputError(
            f"{protocol.source}: the scene has drag, which a sweep cannot compute",
            "leave drag out of the protocol, or use rig predict for single falls",
        )
    chain = next(iter(protocol.chains.values())).chain
    values: dict[str, tuple[float, ...]] = {}
    if chain.alpha is None:
        values["incline"] = protocol.plan.inclines
        values["restitution"] = (protocol.surface.restitution.value,)
        values["friction"] = (protocol.surface.friction.value,)
        values["inertia"] = (chain.inertia / XI,)
        if chain.gamma is not None:
            values["gamma"] = (chain.gamma,)
    else:
        values["alpha"] = (chain.alpha.value,)
        values["gamma"] = (chain.gamma or 0.0,)
    values["drop"] = (protocol.drop.value,)
    if protocol.initial_speed.value:
        values["initial_speed"] = (protocol.initial_speed.value,)
    values["gravity"] = (protocol.gravity.value,)
    return values
