"""YAML text to a small tree in which every node knows its line and column.

The tree is built from the parser's events, not by its loader: no tag can make an object, every
scalar stays the text that was written, repeated keys survive to be reported, and depth and size
are bounded while reading, so that no file can exhaust the stack or the memory.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NoReturn

import yaml

from rig.errors import InputError, Problem
from rig.units import quoted

if TYPE_CHECKING:
    from collections.abc import Iterator

MAX_DEPTH = 32
MAX_NODES = 10_000

# Scalars of the YAML 1.2 core schema (section 10.3.2); what matches nothing here is text, so
# `on`, `yes`, `12:30:00` and `2024-01-01` are text and `1e-3` is a number.
_CORE = (
    ("nothing", re.compile(r"null|Null|NULL|~|")),
    ("a boolean", re.compile(r"true|True|TRUE|false|False|FALSE")),
    ("a whole number", re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+")),
    ("a number", re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")),
    ("a number", re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")),
)


@dataclass(frozen=True, slots=True, order=True)
class Place:
    """Line and column, counted from 1."""

    line: int
    column: int


@dataclass(frozen=True, slots=True)
class ScalarNode:
    """A scalar as written; `plain` when it stood without quotes."""

    text: str
    plain: bool
    place: Place
    size: int = 1

    @property
    def kind(self) -> str:
        """What the core schema takes it for, as a noun."""
        if self.plain:
            for kind, pattern in _CORE:
                if pattern.fullmatch(self.text):
                    return kind
        return "text"

    def __str__(self) -> str:
        if self.kind == "nothing":
            return "nothing"
        return quoted(self.text) if self.kind == "text" else self.text[:40]


@dataclass(slots=True)
class Sequence:
    """A list."""

    place: Place
    items: list[Node] = field(default_factory=list)
    size: int = 1

    def __str__(self) -> str:
        return "a list"


@dataclass(slots=True)
class Mapping:
    """A mapping; entries in file order, repeated keys included."""

    place: Place
    entries: list[tuple[Node, Node]] = field(default_factory=list)
    size: int = 1

    def __str__(self) -> str:
        return "a mapping"


Node = ScalarNode | Sequence | Mapping


def place_of(root: Node, *path: str | int) -> Place:
    """Find where the value at a path of keys and list indices stands, or as much as is there."""
    node = root
    for step in path:
        inner: list[Node] = []
        if isinstance(node, Mapping):
            inner = [value for key, value in node.entries if getattr(key, "text", None) == step]
        elif isinstance(node, Sequence) and isinstance(step, int):
            inner = node.items[step : step + 1]
        if not inner:
            break
        node = inner[0]
    return node.place


def load(text: str, source: str) -> Node:
    """Read one YAML document.

    Parameters
    ----------
    text
        The file's text.
    source
        Its name, for messages.

    Returns
    -------
    ScalarNode, Sequence or Mapping
        The root.

    Raises
    ------
    InputError
        If the text is no YAML, holds tabs, tags, several documents or none, or is nested or
        aliased beyond `MAX_DEPTH` and `MAX_NODES`; located.
    """
    body = text.removeprefix("\ufeff")
    _refuse_tabs(body, source)
    try:
        return _Builder(source).build(yaml.parse(body, Loader=yaml.SafeLoader))
    except yaml.reader.ReaderError as error:
        at = _place_of(body, error.position)
        character = f"U+{ord(body[error.position]):04X}"
        _fail(source, at, f"found the control character {character}; plain text is wanted")
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        at = Place(mark.line + 1, mark.column + 1) if mark else Place(1, 1)
        said = ", ".join(part for part in (error.context, error.problem) if part)
        _fail(source, at, f"not YAML: {' '.join(said.split())}")
    except (yaml.YAMLError, ValueError, ArithmeticError, LookupError) as error:
        # The parser lets a few int() and chr() errors of broken escapes and directives through.
        _fail(source, Place(1, 1), f"not YAML: {' '.join(str(error).split())[:80]}")


def _fail(source: str, at: Place, message: str) -> NoReturn:
    raise InputError(problems=[Problem(source, at.line, at.column, "", message)])


def _place_of(text: str, index: int) -> Place:
    """Return the line and column of a character."""
    before = text[:index]
    return Place(before.count("\n") + 1, index - before.rfind("\n"))


def _refuse_tabs(text: str, source: str) -> None:
    """Refuse tabs outside comments: YAML takes them in some places and not in others."""
    for number, line in enumerate(text.split("\n"), start=1):
        column = line.partition("#")[0].find("\t")
        if column >= 0:
            _fail(source, Place(number, column + 1), "found a tab; use spaces")


class _Builder:
    """Builds the tree from parser events with a stack of its own, so nothing recurses."""

    def __init__(self, source: str) -> None:
        self.source = source
        self.root: Node | None = None
        self.stack: list[tuple[Sequence | Mapping, str | None]] = []
        self.keys: list[Node | None] = []  # per open node: a key that still waits for its value
        self.anchors: dict[str, Node] = {}
        self.nodes = 0

    def build(self, events: Iterator[Any]) -> Node:
        documents = 0
        for event in events:
            place = Place(event.start_mark.line + 1, event.start_mark.column + 1)
            if isinstance(event, yaml.DocumentStartEvent):
                documents += 1
                if documents > 1:
                    _fail(self.source, place, "found a second document; one file is one protocol")
            elif isinstance(event, yaml.NodeEvent):
                self._node(event, place)
            elif isinstance(event, (yaml.SequenceEndEvent, yaml.MappingEndEvent)):
                self._close()
        if self.root is None:
            _fail(self.source, Place(1, 1), "the file is empty; a protocol is wanted")
        return self.root

    def _node(self, event: Any, place: Place) -> None:
        if isinstance(event, yaml.AliasEvent):
            if event.anchor not in self.anchors:
                name = quoted(str(event.anchor))
                _fail(self.source, place, f"found the alias {name}, which names no finished anchor")
            self._add(self.anchors[event.anchor], place)
            return
        if event.tag is not None:
            _fail(self.source, place, f"found the tag {quoted(event.tag)}; tags are not accepted")
        if isinstance(event, yaml.ScalarEvent):
            # "\uD800" in double quotes makes half a character, which no file or database takes.
            if any("\ud800" <= character <= "\udfff" for character in event.value):
                _fail(self.source, place, "found half of a surrogate pair")
            scalar = ScalarNode(event.value, event.style is None, place)
            if event.anchor:
                self.anchors[event.anchor] = scalar
            self._add(scalar, place)
            return
        if len(self.stack) >= MAX_DEPTH:
            _fail(self.source, place, f"nested more than {MAX_DEPTH} deep")
        is_list = isinstance(event, yaml.SequenceStartEvent)
        self.stack.append((Sequence(place) if is_list else Mapping(place), event.anchor))
        self.keys.append(None)

    def _close(self) -> None:
        node, anchor = self.stack.pop()
        self.keys.pop()
        if anchor:
            self.anchors[anchor] = node
        # The parts were counted as they came; only the node itself is new.
        self._add(node, node.place, counted=node.size - 1)

    def _add(self, node: Node, place: Place, counted: int = 0) -> None:
        self.nodes += node.size - counted
        if self.nodes > MAX_NODES:
            _fail(self.source, place, f"more than {MAX_NODES} values, aliases expanded")
        if not self.stack:
            self.root = node
            return
        parent, _ = self.stack[-1]
        parent.size += node.size
        if isinstance(parent, Sequence):
            parent.items.append(node)
        elif (key := self.keys[-1]) is None:
            self.keys[-1] = node
        else:
            parent.entries.append((key, node))
            self.keys[-1] = None
