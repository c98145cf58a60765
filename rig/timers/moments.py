"""Times as files write them, in whole picoseconds: what a file says is what is analysed."""

from decimal import ROUND_HALF_EVEN, Context, Decimal
from fractions import Fraction

from rig.timers.vocabulary import POWERS, form, is_number, unit_of

TICK_HZ = 10**12
LONGEST_PS = 10**33
"""A time of day in nanoseconds since 1970, if it is taken for seconds, is shorter."""
OVERFLOWS = (2**30, 2**32)
"""Counts after which counters begin anew, of MicroPython and of an Arduino."""
HALF_DAY = 12 * 3600 * TICK_HZ
"""After which a clock does."""
LONGEST_DROP = 3600 * TICK_HZ
"""Picoseconds: a drop that takes longer has a wrong unit, or is several runs."""
_EXACT = Context(prec=100, rounding=ROUND_HALF_EVEN)


def moment(text: str, power: int = 0) -> int | None:
    """Read a time as picoseconds: a number, perhaps with its unit, or a time of day.

    Only differences between times matter: the date says nothing, nor does the half of the day, for
    a clock is a counter that begins anew after twelve hours.

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
    hours, minutes, rest = match.groups("0")
    second, *digits = rest.replace(",", ".").split(".")
    ticks = picoseconds(f"{second}.{''.join(digits)}") or 0
    return (60 * (int(hours) % 12) + int(minutes)) * 60 * TICK_HZ + ticks


def picoseconds(text: str, power: int = 0) -> int | None:
    """Read a decimal number of 10^power s as picoseconds, ties to even; `None` for another text."""
    if not is_number(text):
        return None
    number = _EXACT.scaleb(Decimal(text), 12 + power)
    return int(_EXACT.to_integral_value(number)) if abs(number) < LONGEST_PS else None


def seconds(tick: int, rate: Fraction) -> str:
    """Write a time as a plain decimal, exact to the picosecond."""
    # In whole numbers: dividing Fractions costs ten times as much.
    ticks, ratio = 2 * tick * TICK_HZ * rate.denominator, rate.numerator
    rounded = (ticks + ratio) // (2 * ratio)
    integer, part = divmod(abs(rounded), TICK_HZ)
    return f"{'-' if rounded < 0 else ''}{integer}.{part:012d}".rstrip("0").rstrip(".")
