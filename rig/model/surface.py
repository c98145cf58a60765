"""The surface that a chain strikes, and the pile of rods on it."""

from dataclasses import dataclass

from rig.units import Quantity

NO_FRICTION = Quantity(0.0)


@dataclass(frozen=True, slots=True)
class Pile:
    """Rods that gather on a nearly level surface and soften it (section III.D).

    Attributes
    ----------
    below_deg
        Inclines strictly below this one are struck as a pile.
    restitution
        Effective β of the pile; the pile is taken as level (θ = 0).
    """

    below_deg: float
    restitution: Quantity


@dataclass(frozen=True, slots=True)
class Surface:
    """Coefficient of restitution β, of friction μ, and the pile rule if there is one."""

    restitution: Quantity
    friction: Quantity = NO_FRICTION
    pile: Pile | None = None
