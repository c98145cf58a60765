"""Reader of mappings by the table of keys: checks each value and collects all faults.

A `Section` reads all its keys at once. A faulty or missing required value is noted and becomes
``None``. So a single pass finds all faults of a file, and later checks deal only with relations
between keys.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, NoReturn

from rig.errors import Problem
from rig.protocol import keys
from rig.protocol.yamltree import Mapping, Node, Place, ScalarNode, Sequence
from rig.units import UnitError, did_you_mean, parse, quote


@dataclass(slots=True)
class Faults:
    """The problems noted so far in a file; each ends with the `setting` of a plan's varied keys."""

    source: str
    setting: str = ""
    problems: dict[tuple[int, int, str], Problem] = field(default_factory=dict)

    def add(self, place: Place, key: str, message: str) -> None:
        """Note a problem; a fault that chains inherit by `like` is noted once, at its place."""
        problem = Problem(self.source, *place, key, message + self.setting)
        self.problems.setdefault((*place, message), problem)


class UnsoundError(Exception):
    """An object cannot be built from its section; the faults are noted."""


class Section:
    """A mapping of the file, read by its keys in the table.

    Parameters
    ----------
    node
        The mapping.
    path
        Its key path in the file, empty for the root.
    table
        Key path in the table, see `rig.protocol.keys.ANY`.
    faults
        Collects the problems.

    Attributes
    ----------
    values
        Values by key, as read, or defaults; `None` if faulty, or missing without a default.
    """

    def __init__(self, node: Mapping, path: str, table: str, faults: Faults) -> None:
        self.node, self.path, self.faults = node, path, faults
        self.keys, self.nodes = unique_entries(node, path, faults)
        self._accepted = keys.SECTIONS[table]
        self._faulty: set[str] = set()
        self._unknown = self.keys.keys() - self._accepted
        for name in self._unknown:
            self.fault(name, _unknown_key(name, self._accepted), at_key=True)
        self.values = {name: self._read(name, key) for name, key in self._accepted.items()}

    def __contains__(self, name: str) -> bool:
        return name in self.nodes

    def __getitem__(self, name: str) -> Any:
        return self.values[name]

    def _read(self, name: str, key: keys.Key) -> Any:
        if name in self.nodes:
            node, path = self.nodes[name], self.key(name)
            value = read_value(key.accepted, node, path, key.path, self.faults)
            if not _is_sound(value):
                self._faulty.add(name)
            return value
        if key.required:
            self.need(name)
        return DEFAULTS[key.path]

    def is_sound(self, *names: str) -> bool:
        """Whether none of these keys, by default of all, is faulty or missing."""
        return self._faulty.isdisjoint(names) if names else not self._faulty

    def need(self, *names: str) -> str | None:
        """Return the one key of these that is given; notes a fault unless exactly one is."""
        first, *others = sorted(self.keys.keys() & set(names), key=self.keys.__getitem__) or ("",)
        for other in others:
            message = f"{first} is also given, on line {self.keys[first].line}; keep one of them"
            self.fault(other, message, at_key=True)
        if first:
            return None if others else first
        self._faulty.update(names)
        # A seemingly missing key may be misspelt.
        if not self.node.partial and not any(did_you_mean(name, names) for name in self._unknown):
            examples = (f"{name}: {self._accepted[name].example}" for name in names)
            message = f"missing; write for example {', or '.join(examples)}"
            self.faults.add(self.node.place, self.key(names[0]), message)
        return None

    def refuse(self, why: str, *names: str) -> None:
        """Note a fault for each of these keys that is given but not used."""
        for name in filter(self.__contains__, names):
            self.fault(name, why.format(name), at_key=True)

    def key(self, name: str) -> str:
        """Return the full path of a key."""
        return join(self.path, name)

    def place(self, name: str) -> Place:
        """Return the place of a key's value, or of the mapping if the key is missing."""
        return self.nodes[name].place if name in self.nodes else self.node.place

    def fault(self, name: str, message: str, *, at_key: bool = False) -> None:
        """Note a problem with the value of a key, or with the key itself."""
        place = self.keys[name] if at_key else self.place(name)
        self.faults.add(place, self.key(name), message)

    def reject(self, name: str, message: str, *, at_key: bool = False) -> NoReturn:
        """Note a problem and raise `UnsoundError`."""
        self.fault(name, message, at_key=at_key)
        raise UnsoundError

    def require_sound(self, *names: str) -> None:
        """Raise `UnsoundError` if one of these keys, by default of all, is faulty or missing."""
        if not self.is_sound(*names):
            raise UnsoundError


def _is_sound(value: Any) -> bool:
    if isinstance(value, tuple):
        return all(map(_is_sound, value))
    return value.is_sound() if isinstance(value, Section) else value is not None


def _unknown_key(name: str, accepted: Iterable[str]) -> str:
    """Return the message for an unknown key, with a suggestion."""
    word, colon, _ = name.partition(":")
    if colon and word in accepted:  # {channel:0} is one key without a value
        return f"a blank is missing after the colon of {word}"
    return f"unknown key; {did_you_mean(name, accepted)}accepted here: {', '.join(accepted)}"


def join(path: str, key: str) -> str:
    """Return a key path; a key that is not a plain word is quoted, to keep the path on a line."""
    word = key if key.isidentifier() and len(key) <= 40 else quote(key)
    return f"{path}.{word}" if path else word


def unique_entries(
    node: Mapping, path: str, faults: Faults
) -> tuple[dict[str, Place], dict[str, Node]]:
    """Return the places and values of a mapping's keys; notes repeated keys and non-scalar ones."""
    places: dict[str, Place] = {}
    values: dict[str, Node] = {}
    for key, value in node.entries:
        if not isinstance(key, ScalarNode):
            faults.add(key.place, path, f"found {key} as a key; a word is accepted")
        elif key.text in places:
            first = places[key.text].line
            message = f"repeated key, first given on line {first}; keep one of them"
            faults.add(key.place, join(path, key.text), message)
        else:
            places[key.text] = key.place
            values[key.text] = value
    return places, values


def read_value(accepted: keys.Accepted, node: Node, path: str, table: str, faults: Faults) -> Any:
    """Return a value of the file in base units, or note a fault and return ``None``.

    A mapping becomes a `Section` (or stays a node if its keys are free names). A list becomes a
    tuple of values, with ``None`` for faulty items.
    """
    match accepted, node:
        case keys.Either(kinds), _:
            shape = isinstance(node, Sequence), isinstance(node, Mapping)
            for kind in kinds:
                if (isinstance(kind, keys.ListOf), kind is keys.Plain.MAPPED) == shape:
                    value = read_value(kind, node, path, table, faults)
                    # A single value where a list is accepted is a list of one.
                    is_item = keys.ListOf(kind) in kinds and value is not None
                    return (value,) if is_item else value
        case keys.Plain.MAPPED, Mapping():
            return Section(node, path, table, faults) if table in keys.SECTIONS else node
        case keys.ListOf(each), Sequence(items=[_, *_] as items):
            kind, table = each or keys.Plain.MAPPED, f"{table}.{keys.EACH}"
            paths = ((f"{path}[{n}]", item) for n, item in enumerate(items))
            return tuple(read_value(kind, item, at, table, faults) for at, item in paths)
    try:
        return _read_scalar(accepted, node)
    except UnitError as error:
        faults.add(node.place, path, str(error))
    return None


def _read_scalar(accepted: keys.Accepted, node: Node) -> Any:
    """Return the value of a scalar in base units.

    Raises
    ------
    UnitError
        The value is not accepted; names the value and the accepted forms.
    """
    close = ""
    match accepted, node:
        case keys.Range(), ScalarNode(text, kind=kind) if kind not in {"nothing", "a boolean"}:
            quantity = parse(text, accepted.dimension)
            if quantity.value not in accepted:
                raise UnitError(f"found {text}; accepted: {accepted}")
            if accepted.exact and quantity.u > 0:
                raise UnitError(f"found {node}; {accepted.exact}")
            return quantity.value if accepted.exact else quantity
        case keys.Whole(low, high), ScalarNode(text, kind="a whole number") if len(text) <= 30:
            number = int(text, {"0o": 8, "0x": 16}.get(text[:2], 10))
            if low <= number <= high:
                return number
        case keys.OneOf(words), ScalarNode(text):
            if text in words:
                return keys.BOOLEANS.get(text.lower(), text)
            close = did_you_mean(text, words)
        case keys.Plain.TEXT, ScalarNode(text, kind="text"):
            # An escape sequence in a title would act on the terminal that shows it.
            if all(character.isprintable() or character == "\n" for character in text):
                return text
            raise UnitError(f"found {node} with control characters; accepted: plain text")
        case keys.Plain.TEXT, ScalarNode(kind=kind) if kind != "nothing":
            raise UnitError(f'found {node}, which is {kind}; accepted: text, in quotes: "{node}"')
    raise UnitError(f"found {node}; {close}accepted: {accepted}")


def _read_default(key: keys.Key) -> Any:
    """Return the default of a key in base units; `None` if there is none."""
    node = ScalarNode(key.default, plain=True, place=Place(1, 1))
    stated = key.default and not key.in_words
    return read_value(key.accepted, node, key.path, key.path, Faults("")) if stated else None


DEFAULTS: dict[str, Any] = {path: _read_default(key) for path, key in keys.KEYS.items()}
"""Default of each key by its path, in base units; `None` without a default."""
