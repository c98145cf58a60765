"""A dial's size, dimension and range, declared once and read from a URL's query."""

from __future__ import annotations

import math
from dataclasses import field, fields
from typing import TYPE_CHECKING, Any

from rig.errors import InputError
from rig.units import Dimension, UnitError, parse

if TYPE_CHECKING:
    from collections.abc import Mapping

_UNITS = {
    Dimension.TIME: " s",
    Dimension.LENGTH: " m",
    Dimension.ANGLE: " deg",
    Dimension.SPEED: " m/s",
    Dimension.DENSITY: " kg/m^3",
    Dimension.TURNING: " rad/s",
}
"""Of what `parse` gives, as limits are told in."""


def dial(
    default: float,
    dimension: Dimension = Dimension.NUMBER,
    low: float = 0.0,
    high: float = math.inf,
    **traits: bool,
) -> Any:
    """Declare a dial as a dataclass's field.

    Parameters
    ----------
    low, high
        What is accepted, in SI, angles in degrees.
    **traits
        ``kept`` stays as it is on a quiet rig; of a ``switch`` nothing between 0 and 1 is accepted.
        Others are the dataclass's own.
    """
    return field(default=default, metadata={"range": (dimension, low, high), **traits})


def silent_values(kind: Any) -> dict[str, float]:
    """Return what a quiet rig sets to zero."""
    return {spec.name: 0.0 for spec in fields(kind) if not spec.metadata.get("kept")}


def read_values(kind: Any, settings: Mapping[str, str], scheme: str) -> dict[str, float]:
    """Read the dials of one dataclass that a URL names; its other settings are passed over.

    Raises
    ------
    InputError
        A value that is not a quantity of its dimension, or out of range.
    """
    values: dict[str, float] = {}
    for spec in fields(kind):
        if spec.name not in settings:
            continue
        text, (dimension, low, high) = settings[spec.name], spec.metadata["range"]
        where = f"{scheme}://: {spec.name}"
        try:
            value = parse(text, dimension).value
        except UnitError as error:
            raise InputError(f"{where}: {error}") from None
        if spec.metadata.get("switch") and value not in {0.0, 1.0}:
            raise InputError(f"{where}: {text} is neither 0 nor 1")
        if not low <= value <= high:
            accepted = f"{low:g} to {high:g}" if high < math.inf else f"{low:g} or more"
            raise InputError(
                f"{where}: {text} is outside of what is accepted",
                accepted + _UNITS.get(dimension, ""),
            )
        values[spec.name] = value
    return values
