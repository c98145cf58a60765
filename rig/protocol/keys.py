"""Table of all keys of a protocol file: accepted values, default and meaning.

The reader checks a file by this table, `rig check --keys` prints it, `rig check --schema` makes the
JSON Schema of editors from it, and `rig check` and `rig sweep` take ranges and words from it. A new
key is a row of ``keys.txt``, and whatever uses it.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

from rig.text_rows import read_rows
from rig.units import DIMENSIONS, Dimension, Quantity, format_quantity

ANY = "*"
"""Placeholder in a path for names chosen by the file: those of chains."""
EACH = "[]"
"""Placeholder in a path for each item of a list."""
BOOLEANS = {"true": True, "false": False}
"""Words that stand for a boolean, in whichever of the accepted spellings."""

MOST_RODS = 1000
"""Most rods of a chain, in all its groups."""


@dataclass(frozen=True, slots=True)
class Range:
    """Accepted values of a quantity in base units, and the unit for messages.

    `exact` is the message that refuses a written uncertainty; empty if an uncertainty is accepted.
    """

    dimension: Dimension
    low: float
    high: float
    unit: str
    open_low: bool
    exact: str

    def __contains__(self, value: float) -> bool:
        return self.low <= value <= self.high and not (self.open_low and value == self.low)

    def __str__(self) -> str:
        low, high = (format_quantity(Quantity(x), self.unit) for x in (self.low, self.high))
        return f"above {low}, up to {high}" if self.open_low else f"{low} to {high}"


class Whole(NamedTuple):
    """Whole numbers from `low` to `high`."""

    low: int
    high: int

    def __str__(self) -> str:
        between = f"{self.low} to {self.high}"
        return f"a whole number, {between}" if self.low < self.high else str(self.low)


class OneOf(NamedTuple):
    """A choice of words."""

    words: tuple[str, ...]

    def __str__(self) -> str:
        return ", ".join(self.words)


class Either(NamedTuple):
    """A value of several kinds with different notations."""

    kinds: tuple[Accepted, ...]

    def __str__(self) -> str:
        return "; or ".join(map(str, self.kinds))


class ListOf(NamedTuple):
    """A list, whose items have keys of their own or are values."""

    each: Accepted | None

    def __str__(self) -> str:
        return "a list [ … , … ]" + (f" of values, {self.each}" if self.each else "")


class Plain(StrEnum):
    """A mapping, with keys of the table or names chosen by the file; or any text."""

    MAPPED = "a mapping {…: …}"
    TEXT = "text"


Accepted = Range | Whole | OneOf | Either | ListOf | Plain


class Key(NamedTuple):
    """A key of the table.

    Attributes
    ----------
    path
        Path from the root, parts joined by dots; see `ANY` and `EACH`.
    accepted
        Accepted values.
    default
        Default as written in a file; empty without a default.
    required
        Whether the key is required.
    in_words
        Whether the default is a description of how it is derived.
    meaning
        Meaning in words.
    example
        Example as written in a file.
    scene
        Facts of a scene for which the key matters, as in ``describe.txt``.
    source
        Source of the default.
    """

    path: str
    accepted: Accepted
    default: str
    required: bool
    in_words: bool
    meaning: str
    example: str
    scene: str = ""
    source: str = ""


_RANGE = re.compile(r"(\w+) ([\[(])(\S+), (\S+)\] (\S+)( ±)?(?:; (.+))?")


def _read_range(text: str) -> Range:
    parts = _RANGE.fullmatch(text)
    assert parts is not None, text
    name, opening, low, high, unit, with_u, why = parts.groups()
    exact = "" if with_u else why or "no uncertainty is accepted here"
    return Range(DIMENSIONS[name.upper()], float(low), float(high), unit, opening == "(", exact)


def _read_accepted(text: str) -> Accepted:
    if " / " in text:
        return Either(tuple(map(_read_accepted, text.split(" / "))))
    kind, _, rest = text.partition(" ")
    match kind:
        case "keys":
            return Plain.MAPPED
        case "text":
            return Plain.TEXT
        case "whole":
            return Whole(*map(int, rest.split()))
        case "words":
            return OneOf(tuple(rest.split()))
        case "list":
            return ListOf(_read_range(rest.removeprefix("of ")) if rest else None)
    return _read_range(text)


def read_key(cells: Iterable[str]) -> Key:
    """Return the key of a row of ``keys.txt``, whose columns are those of `Key`.

    Parameters
    ----------
    cells
        As the head of that file explains them; the last two are optional.
    """
    name, form, default, *texts = cells
    path, accepted = name.removesuffix("!"), _read_accepted(form)
    required, in_words = name.endswith("!"), default.startswith("(")
    return Key(path, accepted, default.strip("()"), required, in_words, *texts)


KEYS = {key.path: key for key in map(read_key, read_rows(__file__))}
"""Keys by path, in the order of a file."""

SECTIONS: dict[str, dict[str, Key]] = {}
"""The keys of each mapping, by the mapping's path and their own names."""
for _key in KEYS.values():
    _section, _, _name = _key.path.rpartition(".")
    SECTIONS.setdefault(_section, {})[_name] = _key


def range_of(path: str) -> Range:
    """Return the range of a key that is a quantity, or of the items of a list of quantities."""
    accepted = KEYS[path].accepted
    return next(kind for kind in getattr(accepted, "kinds", (accepted,)) if isinstance(kind, Range))
