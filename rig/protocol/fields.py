"""Reading the fields of a mapping: each value checked at its place, every fault kept.

A reader asks a `Section` for each key with a converter. A converter returns the value, or notes a
fault and returns ``None``; so one pass over a file finds everything that is wrong with it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar

from rig.errors import Problem
from rig.protocol.yamltree import Mapping, Node, Place, ScalarNode, Sequence
from rig.units import Dimension, Quantity, UnitError, format_quantity, parse, quoted

T = TypeVar("T")


@dataclass(slots=True)
class FieldFaults:
    """The problems found so far in one file."""

    source: str
    problems: dict[tuple[int, int, str], Problem] = field(default_factory=dict)

    def add(self, place: Place, key: str, message: str) -> None:
        """Note a problem; what a chain inherits by `like` is noted once, where it stands."""
        at = (place.line, place.column, message)
        self.problems.setdefault(at, Problem(self.source, place.line, place.column, key, message))


Converter = Callable[[Node, str, FieldFaults], T | None]


class Section:
    """One mapping of the file.

    Parameters
    ----------
    node
        The mapping.
    path
        Its key path, empty for the root.
    faults
        Where problems go.
    accepted
        All keys it may have; others, and repeated ones, are noted at once.
    lenient
        Do not note missing keys (used when the chain named by `like` is itself faulty).

    Attributes
    ----------
    strange
        Whether any key is not accepted: what seems to be missing may be that one, misspelt.
    """

    def __init__(
        self,
        node: Mapping,
        path: str,
        faults: FieldFaults,
        accepted: tuple[str, ...],
        *,
        lenient: bool = False,
    ) -> None:
        self.node, self.path, self.faults, self.lenient = node, path, faults, lenient
        self.keys, self.values = unique_entries(node, path, faults)
        self.strange = not self.keys.keys() <= set(accepted)
        for key, place in self.keys.items():
            if key not in accepted:
                word, colon, _ = key.partition(":")
                message = f"unknown key; {did_you_mean(key, accepted)}"
                message += f"accepted here: {', '.join(accepted)}"
                if colon and word in accepted:  # {channel:0} is one key without a value
                    message = f"a blank is missing after the colon of {word}"
                faults.add(place, self.key(key), message)

    def __contains__(self, key: str) -> bool:
        return key in self.values

    def key(self, key: str) -> str:
        """Return the full path of one of its keys."""
        return join(self.path, key)

    def place(self, key: str) -> Place:
        """Return where the value of `key` stands, or the mapping itself if it is missing."""
        return self.values[key].place if key in self.values else self.node.place

    def fault(self, key: str, message: str, *, at_key: bool = False) -> None:
        """Note a problem with the value of `key` (or with the key's being there)."""
        place = self.keys[key] if at_key else self.place(key)
        self.faults.add(place, self.key(key), message)

    def refuse(self, message: str) -> None:
        """Note a problem with the mapping as a whole."""
        self.faults.add(self.node.place, self.path, message)

    def take(
        self,
        key: str,
        convert: Converter[T],
        default: T | None = None,
        *,
        required: str = "",
    ) -> T | None:
        """Return the value of a key, `default` if it is missing, ``None`` if it is faulty.

        `required` is an example of the key; when given, a missing key is a fault.
        """
        if key in self.values:
            return convert(self.values[key], self.key(key), self.faults)
        if required and not self.lenient:
            message = f"missing; write for example {key}: {required}"
            self.faults.add(self.node.place, self.key(key), message)
        return default


def join(path: str, key: str) -> str:
    """Return a key path; a key that is no plain word is quoted, so that a line stays a line."""
    shown = key if key.isidentifier() and len(key) <= 40 else quoted(key)
    return f"{path}.{shown}" if path else shown


def did_you_mean(word: str, known: tuple[str, ...]) -> str:
    """Return ``did you mean …? `` for the nearest known word, or nothing."""
    import difflib  # noqa: PLC0415 - only a mistake needs it

    folded = {name.casefold(): name for name in known}
    close = difflib.get_close_matches(word[:40].casefold(), folded, n=1)
    return f"did you mean {folded[close[0]]}? " if close else ""


def unique_entries(
    node: Mapping, path: str, faults: FieldFaults
) -> tuple[dict[str, Place], dict[str, Node]]:
    """Return the places and values of a mapping's keys, noting repeated keys and odd ones."""
    keys: dict[str, Place] = {}
    values: dict[str, Node] = {}
    for key, value in node.entries:
        if not isinstance(key, ScalarNode):
            faults.add(key.place, path, f"found {key} as a key; a word is accepted")
        elif key.text in keys:
            first = keys[key.text].line
            message = f"repeated key, first given on line {first}; keep one of them"
            faults.add(key.place, join(path, key.text), message)
        else:
            keys[key.text] = key.place
            values[key.text] = value
    return keys, values


def mapping(node: Node, key: str, faults: FieldFaults) -> Mapping | None:
    """Convert to a mapping."""
    if isinstance(node, Mapping):
        return node
    faults.add(node.place, key, f"found {node}; accepted: a mapping {{key: value, …}}")
    return None


def of_keys(*accepted: str) -> Callable[[Callable[[Section], T | None]], Converter[T]]:
    """Make the converter of a mapping from what reads its section, which may have these keys."""

    def make(read: Callable[[Section], T | None]) -> Converter[T]:
        def convert(node: Node, key: str, faults: FieldFaults) -> T | None:
            inner = mapping(node, key, faults)
            return None if inner is None else read(Section(inner, key, faults, accepted))

        return convert

    return make


def sequence(node: Node, key: str, faults: FieldFaults) -> Sequence | None:
    """Convert to a list with something in it."""
    if isinstance(node, Sequence) and node.items:
        return node
    found = "an empty list" if isinstance(node, Sequence) else str(node)
    faults.add(node.place, key, f"found {found}; accepted: a list [ … , … ]")
    return None


def string(node: Node, key: str, faults: FieldFaults) -> str | None:
    """Convert to text."""
    if isinstance(node, ScalarNode) and node.kind == "text":
        # An escape sequence in a title would act on the terminal that shows it.
        if all(character.isprintable() or character == "\n" for character in node.text):
            return node.text
        faults.add(node.place, key, f"found {node} with control characters; accepted: plain text")
        return None
    if isinstance(node, ScalarNode) and node.kind != "nothing":
        wanted = f'accepted: text, in quotes: "{node}"'
        faults.add(node.place, key, f"found {node}, which is {node.kind}; {wanted}")
    else:
        faults.add(node.place, key, f"found {node}; accepted: text")
    return None


def choice(*accepted: str) -> Converter[str]:
    """Return a converter to one of a few words."""

    def convert(node: Node, key: str, faults: FieldFaults) -> str | None:
        if isinstance(node, ScalarNode) and node.text in accepted:
            return node.text
        close = did_you_mean(node.text, accepted) if isinstance(node, ScalarNode) else ""
        faults.add(node.place, key, f"found {node}; {close}accepted: {', '.join(accepted)}")
        return None

    return convert


BOOLEANS = dict.fromkeys(("true", "True", "TRUE"), True)
BOOLEANS |= dict.fromkeys(("false", "False", "FALSE"), False)
"""As YAML 1.2 writes them (core schema, section 10.3.2)."""


def boolean(node: Node, key: str, faults: FieldFaults) -> bool | None:
    """Convert to true or false."""
    word = choice(*BOOLEANS)(node, key, faults)
    return None if word is None else BOOLEANS[word]


def whole(low: int, high: int) -> Converter[int]:
    """Return a converter to a whole number from `low` to `high`."""

    def convert(node: Node, key: str, faults: FieldFaults) -> int | None:
        if isinstance(node, ScalarNode) and node.kind == "a whole number" and len(node.text) <= 30:
            sign, digits = (-1, node.text[1:]) if node.text[0] == "-" else (1, node.text)
            base = {"0o": 8, "0x": 16}.get(digits[:2], 10)
            number = sign * int(digits, base)
            if low <= number <= high:
                return number
        faults.add(node.place, key, f"found {node}; accepted: a whole number from {low} to {high}")
        return None

    return convert


@dataclass(frozen=True, slots=True)
class Range:
    """Accepted values in base units, and the unit in which to say so."""

    dimension: Dimension
    low: float
    high: float
    unit: str
    open_low: bool = False

    def __contains__(self, value: float) -> bool:
        return self.low <= value <= self.high and not (self.open_low and value == self.low)

    def __str__(self) -> str:
        low, high = (format_quantity(Quantity(x), self.unit) for x in (self.low, self.high))
        return f"above {low}, up to {high}" if self.open_low else f"{low} to {high}"


def quantity(accepted: Range) -> Converter[Quantity]:
    """Return a converter to a quantity, with its uncertainty if one is written."""

    def convert(node: Node, key: str, faults: FieldFaults) -> Quantity | None:
        if not isinstance(node, ScalarNode) or node.kind in {"nothing", "a boolean"}:
            wanted = f"accepted: {accepted.dimension.noun}, such as {accepted.dimension.example}"
            faults.add(node.place, key, f"found {node}; {wanted}")
            return None
        try:
            read = parse(node.text, accepted.dimension)
        except UnitError as error:
            faults.add(node.place, key, str(error))
            return None
        if read.value not in accepted:
            faults.add(node.place, key, f"found {node.text}; accepted: {accepted}")
            return None
        return read

    return convert


def exact(accepted: Range, hint: str = "no uncertainty is accepted here") -> Converter[float]:
    """Return a converter to a bare value; a written uncertainty is refused, not dropped."""
    inner = quantity(accepted)

    def convert(node: Node, key: str, faults: FieldFaults) -> float | None:
        read = inner(node, key, faults)
        if read is None:
            return None
        if read.u > 0:
            faults.add(node.place, key, f"found {node}; {hint}")
            return None
        return read.value

    return convert
