"""What the simulated air takes from each chain, in either world.

By itself, as `rig.predictions` has it by itself: what reads edges is tried on another's air.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from rig.model.drag import cylinder_drag

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.protocol.protocol import Protocol


class Air(NamedTuple):
    """The air about one chain.

    Attributes
    ----------
    drags, masses
        Of each rod: force over speed squared, and mass, both in units of one mass.
    """

    drags: Sequence[float]
    masses: Sequence[float]

    def on_rods(self) -> list[float]:
        """κ of each rod by itself, 1/m."""
        return [drag / mass for drag, mass in zip(self.drags, self.masses, strict=True)]

    def on_legs(self) -> list[float]:
        """κ of what falls on the leg before each impact, 1/m."""
        return [sum(self.drags[k:]) / sum(self.masses[k:]) for k in range(len(self.masses))]


def air(protocol: Protocol, drag: float) -> dict[str, Air]:
    """Return the air about each chain.

    Parameters
    ----------
    protocol
        Whose own drag, if it states one, is there too.
    drag
        Further κ of the first chain as it hangs; any other rod's goes with its width over its mass.
    """
    chains, stated, factor = protocol.chains.values(), protocol.drag, 0.0
    known = all(rods.diameters and min(rods.diameters) > 0.0 for rods in chains)
    if stated is not None and stated.coefficient is not None:
        factor = stated.coefficient.value * stated.air_density
    elif stated is not None and stated.terminal_speed is not None:
        drag += protocol.gravity.value / stated.terminal_speed.value**2
        known = False  # it is of all rods alike
    sized = known and all(rods.rod_length for rods in chains)
    weighed = sized and all(rods.weighed for rods in chains)
    airs: dict[str, Air] = {}
    for rods in chains:
        diameters = rods.diameters if known else [1.0] * rods.chain.rods
        length, tilt = rods.rod_length if sized else 1.0, rods.tilt_deg if known else 0.0
        drags = [cylinder_drag(1.0, 1.0, diameter, length, tilt) for diameter in diameters]
        # Of one material: as heavy as they are large.
        volumes = [diameter * diameter * length for diameter in diameters]
        masses = rods.chain.masses if weighed else volumes
        if not airs:
            factor += drag * sum(masses) / sum(drags)
        airs[rods.name] = Air([factor * each for each in drags], masses)
    return airs
