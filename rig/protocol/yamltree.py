"""YAML text to a small tree in which every node knows its line and column.

The tree is built from the parser's events, not by its loader: no tag can make an object, every
scalar stays the text that was written, repeated keys survive to be reported, and depth and size
are bounded while reading, so that no file can exhaust the stack or the memory.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import yaml

from rig.errors import InputError, Problem
from rig.printable import one_line
from rig.units import quoted

MAX_DEPTH = 32
MAX_NODES = 10_000
_BREAK = re.compile(r"\r\n|[\n\r\x85\u2028\u2029]")
"""Ends of lines in YAML 1.1, section 5.4: PyYAML counts lines by them."""
_EXCERPT = 72  # columns of a terminal of 80, less an indent

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
    items: list[Node]
    size: int

    def __str__(self) -> str:
        return "a list"


@dataclass(slots=True)
class Mapping:
    """A mapping; entries in file order, repeated keys included."""

    place: Place
    entries: list[tuple[Node, Node]]
    size: int

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
    body = "\n".join(_BREAK.split(text.removeprefix("\ufeff")))
    try:
        _refuse_tabs(body)
        return _Builder().build(yaml.parse(body, Loader=yaml.SafeLoader))
    except _RefusalError as refusal:
        place, message = refusal.place, refusal.message
    except yaml.reader.ReaderError as error:
        character = f"U+{ord(body[error.position]):04X}"
        place = place_at(body, error.position)
        message = f"control character {character}; write plain text only"
    except yaml.MarkedYAMLError as error:
        from rig.protocol.yamlmend import explain  # noqa: PLC0415 - only a mistake needs it

        index, message = explain(body, error)
        place = place_at(body, index)
    except (yaml.YAMLError, ValueError, ArithmeticError, LookupError):
        # The parser lets a few int() and chr() errors of broken escapes and directives through.
        place, message = Place(1, 1), "this file cannot be read; see its quotes and % lines"
    below = _excerpt(body, place)
    raise InputError(problems=[Problem(source, place.line, place.column, "", message, below)])


class _RefusalError(Exception):
    """What a protocol may not have although YAML does."""

    def __init__(self, place: Place, message: str) -> None:
        super().__init__(message)
        self.place, self.message = place, message


def place_at(text: str, index: int) -> Place:
    """Return the line and column of a character by its index."""
    before = text[:index]
    return Place(before.count("\n") + 1, index - before.rfind("\n"))


def _excerpt(text: str, place: Place) -> str:
    """Show a line, or of a long one the part around a place, with a caret below."""
    begin = max(place.column - _EXCERPT // 2, 0)
    line = text.split("\n")[place.line - 1][begin:].replace("\t", " ")
    if not line.strip():
        return ""
    return f"\n    {one_line(line, _EXCERPT).rstrip()}\n    {'^':>{place.column - begin}}"


def _refuse_tabs(text: str) -> None:
    """Refuse tabs outside comments: YAML takes them in some places and not in others."""
    for number, line in enumerate(text.split("\n"), start=1):
        column = line.partition("#")[0].find("\t")
        if column >= 0:
            raise _RefusalError(Place(number, column + 1), "a tab; use blanks")


class _Frame(NamedTuple):
    """A list or mapping that is not closed yet; of a mapping keys and values take turns."""

    place: Place
    anchor: str | None
    is_list: bool
    parts: list[Node]


class _Builder:
    """Builds the tree from parser events with a stack of its own, so nothing recurses."""

    def __init__(self) -> None:
        # Below everything that is open lies the file, a list of documents.
        self.stack = [_Frame(Place(1, 1), None, is_list=True, parts=[])]
        self.anchors: dict[str, Node] = {}
        self.nodes = 0

    def build(self, events: Iterator[Any]) -> Node:
        documents = 0
        for event in events:
            place = Place(event.start_mark.line + 1, event.start_mark.column + 1)
            if isinstance(event, yaml.DocumentStartEvent):
                documents += 1
                if documents > 1:
                    raise _RefusalError(place, "a second document; a file has one protocol")
            elif isinstance(event, yaml.NodeEvent):
                self._node(event, place)
            elif isinstance(event, (yaml.SequenceEndEvent, yaml.MappingEndEvent)):
                self._close()
        if not self.stack[0].parts:
            raise _RefusalError(Place(1, 1), "the file is empty; begin with protocol: 1")
        return self.stack[0].parts[0]

    def _node(self, event: Any, place: Place) -> None:
        if isinstance(event, yaml.AliasEvent):
            if event.anchor not in self.anchors:
                name = quoted(str(event.anchor))
                raise _RefusalError(place, f"no anchor stands before the alias {name}")
            node = self.anchors[event.anchor]
            self._add(node, place, event.anchor, node.size)
        elif event.tag is not None:
            raise _RefusalError(place, f"the tag {quoted(event.tag)} is not accepted; leave it out")
        elif isinstance(event, yaml.ScalarEvent):
            # "\uD800" in double quotes makes half a character, which no file or database takes.
            if any("\ud800" <= character <= "\udfff" for character in event.value):
                raise _RefusalError(place, "half of a surrogate pair; write the character itself")
            self._add(ScalarNode(event.value, event.style is None, place), place, event.anchor)
        elif len(self.stack) > MAX_DEPTH:
            raise _RefusalError(place, f"more than {MAX_DEPTH} levels of brackets or indents")
        else:
            is_list = isinstance(event, yaml.SequenceStartEvent)
            self.stack.append(_Frame(place, event.anchor, is_list, []))

    def _close(self) -> None:
        place, anchor, is_list, parts = self.stack.pop()
        size = 1 + sum(part.size for part in parts)
        entries = list(zip(parts[::2], parts[1::2], strict=not is_list))
        node = Sequence(place, parts, size) if is_list else Mapping(place, entries, size)
        self._add(node, place, anchor)

    def _add(self, node: Node, place: Place, anchor: str | None, count: int = 1) -> None:
        """Append a node to what is open; its parts were counted as they came, but for an alias."""
        self.nodes += count
        if self.nodes > MAX_NODES:
            raise _RefusalError(place, f"more than {MAX_NODES} values, aliases expanded")
        if anchor:
            self.anchors[anchor] = node
        self.stack[-1].parts.append(node)
