"""``NAME=LOW..HIGH:COUNT`` and ``NAME=VALUE``: reading what is to be varied."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rig.errors import InputError
from rig.protocol.fields import did_you_mean
from rig.sweep.grid import spaced
from rig.sweep.variables import VARIABLES
from rig.units import UnitError, parse, quoted

if TYPE_CHECKING:
    from collections.abc import Container, Iterable, Sequence

MOST_VALUES = 1_000_000
_EXAMPLE = "write for example restitution=-0.4..0.9:200 or incline=40deg"


class _FaultError(Exception):
    """Something is wrong with the part of a text that starts at `column` (from 0)."""

    def __init__(self, column: int, message: str) -> None:
        super().__init__(message)
        self.column = column


def read_vary(texts: Iterable[str], known: Sequence[str]) -> dict[str, tuple[float, ...]]:
    """Read all ``--vary`` of a command line.

    Parameters
    ----------
    texts
        Each ``NAME=LOW..HIGH:COUNT``, or ``NAME=VALUE`` to hold a parameter at another value than
        the protocol's. Quantities have their unit, as in a protocol.
    known
        Names of the parameters that the scene has.

    Returns
    -------
    dict of str to tuple of float
        Values by name in the order given, in SI, angles in degrees; one value where one was given.

    Raises
    ------
    InputError
        With every problem found, each with its text and column.
    """
    found: dict[str, tuple[float, ...]] = {}
    problems = []
    for text in texts:
        try:
            name, values = _read(text, known, found)
        except _FaultError as fault:
            problems.append(f"--vary {quoted(text, 80)}, column {fault.column + 1}: {fault}")
        else:
            found[name] = values
    if problems:
        raise InputError("\n".join(problems))
    if all(len(values) == 1 for values in found.values()):
        raise InputError("nothing is varied", f"{_EXAMPLE.partition(' or')[0]} behind --vary")
    return found


def _read(text: str, known: Sequence[str], taken: Container[str]) -> tuple[str, tuple[float, ...]]:
    before, equals, after = text.partition("=")
    name, start = before.strip(), len(before) + 1
    if not equals:
        raise _FaultError(0, _EXAMPLE)
    if name not in known:
        guess = did_you_mean(name, tuple(known))
        raise _FaultError(0, f"not in this scene; {guess}it can vary: {', '.join(known)}")
    if name in taken:
        raise _FaultError(0, "given twice; keep one of them")
    if ".." not in after:
        if ":" in after:
            raise _FaultError(start, f"a range is LOW..HIGH:COUNT; {_EXAMPLE}")
        return name, (_value(name, after, start),)
    low, _, rest = after.partition("..")
    high, colon, count = rest.partition(":")
    middle = start + len(low) + 2
    if high.startswith("."):  # 1...5 may be 1. to .5 or a slip
        raise _FaultError(
            middle - 2, "between LOW and HIGH are two dots, and before a dot is a digit"
        )
    ends = _value(name, low, start), _value(name, high, middle)
    if not ends[0] < ends[1]:
        raise _FaultError(middle, f"found {high.strip()}; it must be more than {low.strip()}")
    if not colon:
        raise _FaultError(middle + len(high), f"say how many values: {text.strip()}:81")
    return name, spaced(*ends, _count(count, middle + len(high) + 1))


def _value(name: str, text: str, column: int) -> float:
    accepted = VARIABLES[name].accepted
    try:
        read = parse(text.strip(), accepted.dimension)
    except UnitError as error:
        raise _FaultError(column, str(error)) from None
    if read.u > 0:
        raise _FaultError(column, f"found {text.strip()}; no uncertainty is used here")
    if read.value not in accepted:
        raise _FaultError(column, f"found {text.strip()}; accepted: {accepted}")
    return read.value


def _count(text: str, column: int) -> int:
    digits = text.strip()
    if digits.isascii() and digits.isdigit() and len(digits) < 10:
        number = int(digits)
        if 2 <= number <= MOST_VALUES:
            return number
    wanted = f"a whole number from 2 to {MOST_VALUES} is wanted"
    raise _FaultError(column, f"found {quoted(digits)}; {wanted}")
