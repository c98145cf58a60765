"""A dial's size, dimension and range, declared once and read from a URL's query."""

from __future__ import annotations

import math
from dataclasses import Field, field
from typing import Any

from rig.errors import InputError
from rig.units import DIMENSIONS, Dimension, UnitError, parse


def dial(
    default: float,
    dimension: Dimension = DIMENSIONS["NUMBER"],
    low: float = 0.0,
    high: float = math.inf,
    **traits: bool | str,
) -> Any:
    """Declare a dial as a dataclass's field.

    Parameters
    ----------
    low, high
        What is accepted, in SI, angles in degrees.
    **traits
        ``kept`` stays as it is on a quiet rig; of a ``switch`` nothing between 0 and 1 is accepted;
        ``stated`` is where a protocol has the same, by attributes, empty where each chain has its
        own, and ``guessed`` that nobody has measured it there.
    """
    return field(default=default, metadata={"range": (dimension, low, high), **traits})


def read_value(spec: Field[Any], text: str, where: str) -> float:
    """Read a dial.

    Parameters
    ----------
    where
        It stands, for messages.

    Raises
    ------
    InputError
        What is not a quantity of its dimension, or out of range.
    """
    dimension, low, high = spec.metadata["range"]
    try:
        value = parse(text, dimension).value
    except UnitError as error:
        raise InputError(f"{where}: {error}") from None
    if spec.metadata.get("switch") and value not in {0.0, 1.0}:
        raise InputError(f"{where}: {text} is neither 0 nor 1")
    if not low <= value <= high:
        accepted = f"{low:g} to {high:g}" if high < math.inf else f"{low:g} or more"
        unit = "" if dimension is DIMENSIONS["NUMBER"] else f" {next(iter(dimension.factors))}"
        raise InputError(f"{where}: {text} is outside of what is accepted", accepted + unit)
    return value
