"""Numbers as a physicist writes them: the uncertainty decides the digits."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from itertools import groupby
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rig.measurands import Measurand

MINUS = "−"
_NEGATIVE = re.compile(r"(?<![\w.-])-(?=\d)")


def value_of(quantity: object) -> float | None:
    """Best estimate of a quantity, be it typed or as in JSON, or a bare number.

    `None` where there is none, or none that is finite.
    """
    if isinstance(quantity, Mapping):
        quantity = quantity.get("value")
    else:
        quantity = getattr(quantity, "value", quantity)
    if isinstance(quantity, bool) or not isinstance(quantity, (int, float)):
        return None
    return float(quantity) if math.isfinite(quantity) else None


def fixed(value: float | None, decimals: int) -> str:
    """Write a number with that many decimals and a true minus sign; nothing for `None`."""
    if value is None:
        return ""
    text = f"{value:.{decimals}f}"
    if not text.strip("-0."):
        text = text.lstrip("-")
    return text.replace("-", MINUS)


def signed(text: str) -> str:
    """Give negative numbers within a sentence a true minus sign."""
    return _NEGATIVE.sub(MINUS, text)


def degrees(incline_deg: float) -> str:
    """Write an inclination."""
    return f"{incline_deg:g}".replace("-", MINUS)


def decimals_for(uncertainty: float | None, default: int = 3) -> int:
    """Decimals that show two significant digits of an uncertainty (GUM 7.2.6)."""
    if uncertainty is None or uncertainty <= 0:
        return default
    exponent = f"{uncertainty:.1e}".partition("e")[2]  # of 0.0996 that of 0.10
    return min(max(1 - int(exponent), 0), 9)


def plus_minus(quantity: object, scale: float = 1.0, default: int = 3) -> str:
    """Write ``value ± U95`` with the digits U95 deserves; nothing where there is no value.

    Parameters
    ----------
    quantity
        Measured, ``{"value", "u", "U95"}`` as in JSON, a bare number or `None`.
    scale
        Factor to the unit of the column, for example 100 from m to cm.
    default
        Decimals where there is no uncertainty.
    """
    value = value_of(quantity)
    json = quantity if isinstance(quantity, Mapping) else {}
    uncertainty = value_of(json.get("U95", getattr(quantity, "expanded", None)))
    if value is None:
        return ""
    if uncertainty is None:
        return fixed(value * scale, default)
    decimals = decimals_for(uncertainty * scale, default)
    return f"{fixed(value * scale, decimals)} ± {fixed(uncertainty * scale, decimals)}"


def with_unit(quantity: object, row: Measurand) -> str:
    """Write a measurand ± U in its usual unit."""
    return f"{plus_minus(quantity, row.scale, row.decimals)} {row.unit}"


def ranges(noun: str, numbers: Iterable[int]) -> str:
    """Write numbers, neighbours together: runs 3, 5–8."""
    spans = [
        [number for _, number in neighbours]
        for _, neighbours in groupby(
            enumerate(sorted(set(numbers))), lambda pair: pair[1] - pair[0]
        )
    ]
    names = [f"{span[0]}–{span[-1]}" if span[1:] else f"{span[0]}" for span in spans]
    return f"{noun}{'s' if len(names) > 1 or '–' in names[0] else ''} {', '.join(names)}"
