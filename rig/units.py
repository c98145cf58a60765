"""Quantities as people write them in files: ``48.5 mm``, ``0.50 ± 0.05``, ``9.81 m/s^2``.

The number is scaled by an exact fraction and rounded once, so ``48.5 mm`` is the float nearest to
0.0485 and not the product of two floats.
"""

import math
import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from typing import NamedTuple

from rig.text_rows import read_rows

COVERAGE_95 = 1.959963984540054
"""Standard uncertainties of a normal distribution for 95 % coverage."""


@dataclass(frozen=True, slots=True)
class Quantity:
    """A value with its standard uncertainty, both in the same base unit.

    Base units are SI, except angles, which stay in degrees so that ``40 deg`` is exactly 40.

    Attributes
    ----------
    value
        Best estimate.
    u
        Standard uncertainty (GUM, k = 1); what a file writes behind ``±``. Zero when not stated.
    """

    value: float
    u: float = 0.0

    @property
    def expanded(self) -> float | None:
        """Expanded uncertainty for 95 % coverage; `None` where the value is exact."""
        return COVERAGE_95 * self.u or None


class UnitError(ValueError):
    """A text is not the quantity that was asked for; says what was found and what is accepted."""


class Dimension(NamedTuple):
    """What a quantity measures, as its row of ``units.txt`` has it.

    Attributes
    ----------
    noun, example
        For messages.
    factors
        What each accepted unit is in base units.
    """

    noun: str
    example: str
    factors: Mapping[str, Fraction]


def _dimension(noun: str, example: str, units: str) -> Dimension:
    pairs = map(str.split, units.split(", "))
    return Dimension(noun, example, {unit: Fraction(factor) for unit, factor in pairs})


DIMENSIONS = {name: _dimension(*cells) for name, *cells in read_rows(__file__)}
UNITS: dict[str, tuple[Dimension, Fraction]] = {
    unit: (dimension, factor)
    for dimension in DIMENSIONS.values()
    for unit, factor in dimension.factors.items()
}
"""What each unit measures, and what it is in base units."""
# The micro sign and the Greek letter look alike and both come off keyboards.
_SPELLINGS = str.maketrans({"μ": "µ", "²": "^2", "³": "^3", "°": "deg"})
_ALIASES = {"um": "µm", "us": "µs"}
_POWER = re.compile(r"(?<=[a-z])(?=[23]$)")  # m/s2
_RELATIVE = ("%", "ppm")

_NUMBER = r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
_UNIT = r"(?:(?<=\s)1|[^\s0-9.,±+()-][^±+()]*?)"
_PLUS_MINUS = r"(?:±|\+/-|\+-)"
# Behind a value: how far off its last digits are, or what it is divided by.
_LAST_DIGITS = r"(?:\((?P<last>[0-9]+)\)|/(?P<per>0*[1-9][0-9]*))?"
_PLAIN = re.compile(
    rf"(?P<value>{_NUMBER}){_LAST_DIGITS}\s*(?P<unit>{_UNIT})?\s*"
    rf"(?:{_PLUS_MINUS}\s*(?P<u>{_NUMBER})\s*(?P<u_unit>{_UNIT})?)?"
)
_BRACKETED = re.compile(rf"^\(\s*({_NUMBER})\s*({_PLUS_MINUS})\s*({_NUMBER})\s*\)(.*)")
_DECIMAL_COMMA = re.compile(r"([0-9]),([0-9])")
_LONGEST = 100
_LARGEST_EXPONENT = 400  # beyond any float, and small enough to expand into a fraction


def significant(value: float) -> str:
    """Write a number with two significant digits and never an exponent."""
    return f"{Decimal(f'{value:.2g}'):f}"


def quote(text: str, limit: int = 40) -> str:
    """Return `text` for a one-line message: in quotes, control characters escaped, cut short."""
    return repr(text if len(text) <= limit else text[:limit] + "…")


def did_you_mean(word: str, accepted: Iterable[str], least: float = 0.6) -> str:
    """Return ``did you mean …? `` for the nearest accepted word, or nothing.

    `least` is how near that has to be, from 0 to 1 for the same word.
    """
    import difflib  # noqa: PLC0415 - only a mistake needs it

    folded = {name.casefold(): name for name in accepted}
    close = difflib.get_close_matches(word[:40].casefold(), folded, n=1, cutoff=least)
    return f"did you mean {folded[close[0]]}? " if close else ""


def parse(text: str, dimension: Dimension) -> Quantity:
    """Read a quantity of a given dimension.

    Parameters
    ----------
    text
        ``180 mm``, ``180 ± 2 mm``, ``1.2 m +/- 2 mm``, ``(180 ± 2) mm``, ``180(2) mm``, ``1/12``.
        A number without a unit is accepted only where a plain number is wanted.
    dimension
        What the text must measure.

    Returns
    -------
    Quantity
        In base units (SI; angles in degrees), each number correctly rounded.

    Raises
    ------
    UnitError
        If the text is no such quantity; the message says what was found and what is accepted.
    """
    accepted_form = f"accepted: {dimension.noun}, such as {dimension.example}"
    clean = " ".join(text.split()).replace("−", "-")
    if len(clean) > _LONGEST:
        raise UnitError(f"found a text of {len(clean)} characters; {accepted_form}")
    match = _match(clean)
    if match is None:
        pointed = _DECIMAL_COMMA.sub(r"\1.\2", clean)
        if _match(pointed) is not None:
            accepted_form = f"write a decimal point, not a comma: {pointed}"
        raise UnitError(f"found {quote(text)}; {accepted_form}")
    parts = match.groupdict()
    unit, u_unit, u_number = parts["unit"], parts["u_unit"], parts["u"]
    if u_number is not None:
        if unit is not None and u_unit is None:
            raise UnitError(f"found {quote(clean)}; the part after ± needs a unit too")
        if unit is None and u_unit in _RELATIVE:
            # "0.50 ± 10 %" is read by some as 10 % of 0.50 and by others as (0.50 ± 10) %.
            raise UnitError(
                f"found {quote(clean)}, which has two meanings; "
                f"write both parts in the same unit: 0.50 ± 0.05 or 50 % ± 5 %"
            )
        unit = unit or u_unit
    factor = _factor(unit, dimension, clean)
    value = _scale(parts["value"], factor / int(parts["per"] or 1), clean)
    if parts["last"]:
        if u_number is not None:
            raise UnitError(f"found {quote(text)} with two uncertainties; {accepted_form}")
        u_number = f"{parts['last']}e{Decimal(parts['value']).as_tuple().exponent}"
    u = _scale(u_number or "0", _factor(u_unit or unit, dimension, clean), clean)
    if u < 0:
        raise UnitError(f"found {quote(text)}; an uncertainty is at least 0")
    return Quantity(value, u)


def _match(text: str) -> re.Match[str] | None:
    """Match a quantity; a unit behind brackets is of both numbers in them."""
    return _PLAIN.fullmatch(_BRACKETED.sub(r"\1 \4 \2 \3 \4", text))


def _factor(unit: str | None, dimension: Dimension, text: str) -> Fraction:
    """Return what one `unit` is in base units, if it measures `dimension`."""
    name = "".join((unit or "1").split()).translate(_SPELLINGS).replace("**", "^")
    name = _ALIASES.get(name, _POWER.sub("^", name))
    accepted = f"{dimension.noun} is written in {', '.join(dimension.factors)}"
    if name not in UNITS:
        guess = did_you_mean(name, dimension.factors, least=0.5)
        raise UnitError(f"unknown unit {quote(unit or '')}; {guess}{accepted}")
    measures, factor = UNITS[name]
    if measures is not dimension:
        if unit is None:
            raise UnitError(
                f"found {quote(text)} without a unit; {accepted}, such as {dimension.example}"
            )
        raise UnitError(
            f"{text} is {measures.noun}; accepted: {dimension.noun}, such as {dimension.example}"
        )
    return factor


def _scale(number: str, factor: Fraction, text: str) -> float:
    """Return ``number × factor``, rounded once."""
    with suppress(ArithmeticError):
        exact = Decimal(number)
        if exact == 0:
            return 0.0
        is_usual = abs(exact.adjusted()) <= _LARGEST_EXPONENT
        if is_usual and (result := float(Fraction(exact) * factor)):
            return result
    raise UnitError(f"found {quote(text)}, too large or too small")


def format_quantity(quantity: Quantity, unit: str) -> str:
    """Write a quantity for a table or a message.

    Parameters
    ----------
    quantity
        In base units.
    unit
        One of `UNITS`; ``1`` writes no unit.

    Returns
    -------
    str
        ``180.0 ± 2.0 mm``: the uncertainty to two significant digits and the value to the same
        place; without an uncertainty the value to six significant digits.
    """
    factor = float(UNITS[unit][1])
    value, u = quantity.value / factor, quantity.u / factor
    suffix = "" if unit == "1" else f" {unit}"
    if not (u > 0 and math.isfinite(u) and math.isfinite(value)):
        return f"{value:.6g}{suffix}"
    places = 1 - int(f"{u:.1e}".partition("e")[2])  # after rounding: 0.0996 is 0.10, not 0.100
    numbers = " ± ".join(f"{round(x, places):.{max(places, 0)}f}" for x in (value, u))
    return f"({numbers}){suffix}" if unit in _RELATIVE else f"{numbers}{suffix}"
