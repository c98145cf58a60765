"""The ``drag`` of a protocol."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rig.protocol import fields
from rig.protocol.fields import Range
from rig.protocol.protocol import Drag
from rig.units import Dimension

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rig.protocol.fields import Converter, Section
    from rig.protocol.protocol import RodChain

COEFFICIENT = Range(Dimension.NUMBER, 0.0, 10.0, "1", open_low=True)
DENSITY = Range(Dimension.DENSITY, 0.0, 100.0, "kg/m^3", open_low=True)
TERMINAL_SPEED = Range(Dimension.SPEED, 0.01, 1e4, "m/s")


def read_drag(chains: Iterable[RodChain]) -> Converter[Drag]:
    """Return the converter to the air.

    Parameters
    ----------
    chains
        All chains that could be read: a coefficient needs their rods' masses and sizes.
    """

    @fields.of_keys("coefficient", "air_density", "terminal_speed")
    def convert(section: Section) -> Drag | None:
        usual = Drag()
        coefficient = section.take("coefficient", fields.quantity(COEFFICIENT))
        density = section.take("air_density", fields.exact(DENSITY), usual.air_density)
        terminal = section.take("terminal_speed", fields.quantity(TERMINAL_SPEED))
        if ("coefficient" in section) == ("terminal_speed" in section):
            message = "state either coefficient: 1.1 ± 0.2 or terminal_speed: 25 m/s"
            if not section.strange:
                section.refuse(message)
            return None
        if terminal is not None:
            if "air_density" in section:
                message = "not used with terminal_speed; leave air_density out"
                section.fault("air_density", message, at_key=True)
            return Drag(terminal_speed=terminal)
        for rods in chains:
            missing = _missing(rods)
            if missing and "coefficient" in section:
                message = f"needs {missing} of {rods.name}"
                section.fault("coefficient", f"{message}; state it, or terminal_speed instead")
        return None if coefficient is None or density is None else Drag(coefficient, density)

    return convert


def _missing(rods: RodChain) -> str:
    """Name the keys without which the drag of a rod is not known."""
    lacking = {
        "mass": not rods.weighed,
        "diameter": min(rods.diameters) == 0.0,
        "rod_length": math.isnan(rods.rod_length),
    }
    return ", ".join(key for key, lacks in lacking.items() if lacks)
