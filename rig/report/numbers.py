"""Formatting of numbers: the uncertainty determines the digits."""

import math
import re
from collections.abc import Iterable
from itertools import groupby

from rig.measurands import Measurand

MINUS = "−"
_NEGATIVE = re.compile(r"(?<![\w.-])-(?=\d)")


def value_of(quantity: object) -> float | None:
    """Return the best estimate of a quantity, or a bare number; `None` if not finite."""
    value = getattr(quantity, "value", quantity)
    return float(value) if isinstance(value, (int, float)) and math.isfinite(value) else None


def fixed(value: float | None, decimals: int) -> str:
    """Return a number with `decimals` decimals and a true minus sign; empty for `None`."""
    if value is None:
        return ""
    return f"{value:z.{decimals}f}".replace("-", MINUS)


def signed(text: str) -> str:
    """Return a sentence with true minus signs in negative numbers."""
    return _NEGATIVE.sub(MINUS, text)


def degrees(incline_deg: float) -> str:
    """Return an inclination as text."""
    return f"{incline_deg:g}".replace("-", MINUS)


def decimals_for(uncertainty: float | None, default: int = 3) -> int:
    """Return the decimals that show two significant digits of an uncertainty (GUM 7.2.6)."""
    if uncertainty is None or uncertainty <= 0:
        return default
    # After rounding: 0.0996 counts as 0.10.
    return min(max(1 - int(f"{uncertainty:.1e}".partition("e")[2]), 0), 9)


def plus_minus(quantity: object, scale: float = 1.0, default: int = 3) -> str:
    """Return ``value ± U95`` with two significant digits of U95; empty without a value.

    Parameters
    ----------
    quantity
        Measured, a bare number or `None`.
    scale
        Factor to the unit of the column, for example 100 from m to cm.
    default
        Decimals without an uncertainty.
    """
    value, expanded = value_of(quantity), value_of(getattr(quantity, "expanded", None))
    if value is None or expanded is None:
        return fixed(value and value * scale, default)
    decimals = decimals_for(expanded * scale, default)
    return f"{fixed(value * scale, decimals)} ± {fixed(expanded * scale, decimals)}"


def with_unit(quantity: object, row: Measurand) -> str:
    """Return a measurand ± U in its usual unit."""
    return f"{plus_minus(quantity, row.scale, row.decimals)} {row.unit}"


def ranges(noun: str, numbers: Iterable[int]) -> str:
    """Return numbers with consecutive ones as ranges: runs 3, 5–8."""
    places = {number: place for place, number in enumerate(sorted(set(numbers)))}
    spans = [[*span] for _, span in groupby(places, lambda number: number - places[number])]
    names = ["–".join(str(end) for end in dict.fromkeys((each[0], each[-1]))) for each in spans]
    return f"{noun}{'s' * (len(places) > 1)} {', '.join(names)}"
