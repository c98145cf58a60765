"""What the simulated air takes from each chain."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rig.model.drag import cylinder_drag, leg_drags

if TYPE_CHECKING:
    from rig.protocol.protocol import Protocol, RodChain


def air(protocol: Protocol, drag: float) -> dict[str, list[float]]:
    """κ of each chain on the leg before each impact, 1/m; empty lists in vacuum.

    Parameters
    ----------
    protocol
        Whose own drag, if it states one, is there too.
    drag
        Further κ of the first chain as it hangs; any other rod's goes with its width over its mass.
    """
    chains, stated = protocol.chains.values(), protocol.drag
    if stated is not None and stated.terminal_speed is not None:
        kappa = protocol.gravity.value / stated.terminal_speed.value**2 + drag
        return {name: [kappa] * rods.chain.rods for name, rods in protocol.chains.items()}
    sizes_known = all(rods.diameters and min(rods.diameters) > 0.0 for rods in chains)
    sized = sizes_known and all(rods.rod_length for rods in chains)
    weighed = sized and all(rods.weighed for rods in chains)
    per_mass = {
        name: _legs(rods, sizes_known=sizes_known, sized=sized, weighed=weighed)
        for name, rods in protocol.chains.items()
    }
    factor = drag / next(iter(per_mass.values()))[0]
    if stated is not None and stated.coefficient is not None:
        factor += stated.coefficient.value * stated.air_density
    return {
        name: [factor * leg for leg in legs] if factor else [] for name, legs in per_mass.items()
    }


def stated_air(protocol: Protocol, rods: RodChain) -> list[float]:
    """κ of each rod by itself in the air that a protocol states, 1/m; 0 where it states none."""
    stated = protocol.drag
    if stated is None or stated.coefficient is None:
        speed = stated.terminal_speed.value if stated and stated.terminal_speed else math.inf
        return [protocol.gravity.value / speed**2] * rods.chain.rods
    drag, density, tilt = stated.coefficient.value, stated.air_density, rods.tilt_deg
    return [
        cylinder_drag(drag, density, diameter, rods.rod_length, tilt) / mass
        for diameter, mass in zip(rods.diameters, rods.chain.masses, strict=True)
    ]


def _legs(rods: RodChain, *, sizes_known: bool, sized: bool, weighed: bool) -> list[float]:
    """Drag over mass of what falls on each leg, for C ρ = 1."""
    if not sizes_known:
        return [1.0] * rods.chain.rods
    length = rods.rod_length if sized else 1.0
    drags = [cylinder_drag(1.0, 1.0, d, length, rods.tilt_deg) for d in rods.diameters]
    if weighed:
        return leg_drags(rods.chain, drags)
    # Of one material: as heavy as they are large.
    falling = [sum(drags[k:]) for k in range(len(drags))]
    heavy = [sum(d * d * length for d in rods.diameters[k:]) for k in range(len(drags))]
    return [drag_left / mass_left for drag_left, mass_left in zip(falling, heavy, strict=True)]
