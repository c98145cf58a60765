"""The ``surface`` of a protocol."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.model.surface import Pile, Surface
from rig.protocol import fields
from rig.protocol.fields import Range
from rig.units import Dimension, Quantity

if TYPE_CHECKING:
    from rig.protocol.fields import Converter, Section

# An effective restitution below zero is a pile that gives way (the paper finds −0.37).
RESTITUTION = Range(Dimension.NUMBER, -1.0, 1.0, "1")
FRICTION = Range(Dimension.NUMBER, 0.0, 10.0, "1")
BELOW = Range(Dimension.ANGLE, 0.0, 90.0, "deg", open_low=True)


def read_surface(*, needs_restitution: bool) -> Converter[Surface]:
    """Return the converter to the surface.

    Parameters
    ----------
    needs_restitution
        Whether any chain's α must come from the surface. Otherwise ``surface: {}`` will do, and
        the restitution of the result is a zero that nothing reads.
    """
    example = "0.50 ± 0.05" if needs_restitution else ""

    @fields.of_keys("restitution", "friction", "pile")
    def convert(section: Section) -> Surface | None:
        restitution = section.take(
            "restitution", fields.quantity(RESTITUTION), Quantity(0.0), required=example
        )
        friction = section.take("friction", fields.quantity(FRICTION), Quantity(0.0))
        pile = section.take("pile", _pile)
        if restitution is None or friction is None or ("pile" in section and pile is None):
            return None
        return Surface(restitution, friction, pile)

    return convert


@fields.of_keys("below", "restitution")
def _pile(section: Section) -> Pile | None:
    """Convert the rule for rods that gather on a nearly level surface."""
    below = section.take("below", fields.exact(BELOW), required="30 deg")
    restitution = section.take("restitution", fields.quantity(RESTITUTION), required="-0.37")
    return None if below is None or restitution is None else Pile(below, restitution)
