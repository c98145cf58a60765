"""The parameters of which a sweep can make an axis, and which of them a scene has."""

from typing import NamedTuple

from rig.model.chain import XI
from rig.model.impact import BETA, MU
from rig.protocol.keys import Range, range_of
from rig.protocol.protocol import Protocol
from rig.reasons import rig_error
from rig.text_rows import read_rows

Grid = dict[str, tuple[float, ...]]
"""Values of each parameter, by its name."""


class Variable(NamedTuple):
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
    name: Variable(range_of(key), column, label) for name, key, column, label in read_rows(__file__)
}
"""By name; ``variables.txt`` has the name, the key of a protocol that has its range, and these."""


def scene_values(protocol: Protocol) -> Grid:
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
        raise rig_error("sweep_of_no_surface", protocol=protocol.source)
    if protocol.drag is not None:
        raise rig_error("sweep_in_air", protocol=protocol.source)
    chain = next(iter(protocol.chains.values())).chain
    stated: Grid = {}
    values: dict[str, float | None] = {}
    if chain.alpha is None:
        stated["incline"] = protocol.plan.inclines
        values |= {name: getattr(protocol.surface, name).value for name in (BETA, MU)}
        values |= {"inertia": chain.inertia / XI, "gamma": chain.gamma}
    else:
        values |= {"alpha": chain.alpha.value, "gamma": chain.gamma or 0.0}
    values["drop"] = protocol.drop.value
    values["initial_speed"] = protocol.initial_speed.value or None
    values["gravity"] = protocol.gravity.value
    return stated | {name: (value,) for name, value in values.items() if value is not None}
