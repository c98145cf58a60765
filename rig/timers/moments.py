"""Times as files write them, in whole picoseconds: what a file says is what is analysed."""

from __future__ import annotations

from datetime import date
from decimal import ROUND_HALF_EVEN, Context
from fractions import Fraction

from rig.timers.vocabulary import POWERS, form, is_number, unit_of

TICK_HZ = 10**12
LONGEST_PS = 10**33
"""A time of day in nanoseconds since 1970, if it is taken for seconds, is shorter."""
_SHORT = 20
"""Characters of a number that is far less than that."""
LONGEST_S = 86400
"""How long a recording may be: more means a wrong unit."""
_EXACT = Context(prec=100, rounding=ROUND_HALF_EVEN)


def moment(text: str, power: int = 0) -> int | None:
    """Read a time as picoseconds: a number, perhaps with its unit, or a date with its time of day.

    Parameters
    ----------
    power
        Of ten, units in a second: 3 for milliseconds.

    Returns
    -------
    int or None
        `None` for what is no such time.
    """
    if not text[-1:].isdigit() and (timed := form("timed").fullmatch(text)):
        text, power = timed[1].replace(",", "."), POWERS[unit_of(timed[2])]
    if ":" not in text or (match := form("clock").fullmatch(text)) is None:
        return picoseconds(text, -power)
    first, mark, middle, third, past, hours, minutes, rest, half = match.groups("0")
    days, hour = int(past), int(hours)
    if half != "0":
        hour = hour % 12 + 12 * (half in "pP")
    if int(third):
        # Only how many days lie between two times matters: which part is the year is enough.
        parts = [*map(int, (first, middle, third))]
        year, month, day = parts if len(first) > 2 else parts[::-1]
        if mark == "/" and parts[0] <= 12:
            month, day = parts[:2]
        try:
            days = date(year, month, day).toordinal()
        except ValueError:
            return None
    second, *digits = rest.replace(",", ".").split(".")
    ticks = picoseconds(f"{second}.{''.join(digits)}") or 0
    return (60 * (24 * days + hour) + int(minutes)) * 60 * TICK_HZ + ticks


def picoseconds(text: str, power: int = 0) -> int | None:
    """Read a decimal number of 10^power s as picoseconds, ties to even; `None` for another text."""
    whole, _, part = text.partition(".")
    places = 12 + power - len(part)
    if len(text) < _SHORT and places >= 0 and text.isascii() and (whole + part).isdecimal():
        return int(whole + part + "0" * places)  # as most, in half the time
    if not is_number(text):
        return None
    number = _EXACT.scaleb(_EXACT.create_decimal(text), 12 + power)
    return int(_EXACT.to_integral_value(number)) if abs(number) < LONGEST_PS else None


def seconds(tick: int, rate: Fraction) -> str:
    """Write a time as a plain decimal, exact to the picosecond."""
    # In whole numbers: dividing Fractions costs ten times as much.
    ticks, ratio = 2 * tick * TICK_HZ * rate.denominator, rate.numerator
    rounded = (ticks + ratio) // (2 * ratio)
    integer, part = divmod(abs(rounded), TICK_HZ)
    return f"{'-' if rounded < 0 else ''}{integer}.{part:012d}".rstrip("0").rstrip(".")
