"""YAML parser that returns a tree whose nodes have line and column.

The tree is built from the parser's events, not by its loader. So no tag can create an object,
scalars remain text, repeated keys can be reported, and depth and size are bounded: no file can
exhaust stack or memory.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import yaml

from rig.errors import InputError, Problem
from rig.printable import one_line
from rig.units import quote

MAX_DEPTH = 32
MAX_NODES = 10_000
_BREAK = re.compile(r"\r\n|[\n\r\x85\u2028\u2029]")
"""Line breaks of YAML 1.1, section 5.4, by which PyYAML counts lines."""
_TAB = re.compile(r"^[^\t#\n]*\t", re.MULTILINE)
"""A tab outside comments, which YAML accepts only in some places."""
_EXCERPT = 72  # columns of a terminal of 80, less an indent

# Scalars of the YAML 1.2 core schema (section 10.3.2); anything else is text, so
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
    """A scalar as written; `plain` if without quotes."""

    text: str
    plain: bool
    place: Place

    @property
    def kind(self) -> str:
        """Type of the scalar in the core schema, as a noun."""
        kinds = (kind for kind, pattern in _CORE if pattern.fullmatch(self.text))
        return next(kinds, "text") if self.plain else "text"

    def __str__(self) -> str:
        if self.kind == "nothing":
            return "nothing"
        return quote(self.text) if self.kind == "text" else self.text[:40]


@dataclass(slots=True)
class Sequence:
    """A list."""

    place: Place
    items: list[Node]

    def __str__(self) -> str:
        return "a list" if self.items else "an empty list"


@dataclass(slots=True)
class Mapping:
    """A mapping; entries in file order, repeated keys included."""

    place: Place
    entries: list[tuple[Node, Node]]

    def get(self, name: str | int) -> Node | None:
        """Return the first value of a key."""
        values = (value for key, value in self.entries if getattr(key, "text", None) == name)
        return next(values, None)

    def __str__(self) -> str:
        return "a mapping"


Node = ScalarNode | Sequence | Mapping


def place_of(root: Node, *path: str | int) -> Place:
    """Return the place of the value at a path of keys and indices, or of its last existing part."""
    node = root
    for step in path:
        items: dict[Any, Node] = dict(enumerate(getattr(node, "items", ())))
        inner = node.get(step) if isinstance(node, Mapping) else items.get(step)
        if inner is None:
            break
        node = inner
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
        The text is not YAML, has tabs, tags, several documents or none, or is nested or
        aliased beyond `MAX_DEPTH` and `MAX_NODES`; located.
    """
    body = "\n".join(_BREAK.split(text.removeprefix("\ufeff")))
    try:
        return _Builder(body).build()
    except _RefusalError as refusal:
        index, message = refusal.args
    except yaml.reader.ReaderError as error:
        index = error.position
        message = f"control character U+{ord(body[index]):04X}; write plain text only"
    except yaml.MarkedYAMLError as error:
        from rig.protocol.yamlmend import explain  # noqa: PLC0415 - only a mistake needs it

        index, message = explain(body, error)
    except (yaml.YAMLError, ValueError, ArithmeticError, LookupError):
        # The parser leaks int() and chr() errors of broken escapes and directives.
        index, message = 0, "this file cannot be read; see its quotes and % lines"
    place = place_at(body, index)
    below = _excerpt(body, place)
    raise InputError(problems=[Problem(source, place.line, place.column, "", message, below)])


class _RefusalError(Exception):
    """Valid YAML that a protocol may not contain: index in the text, and a message."""


def place_at(text: str, index: int) -> Place:
    """Return the line and column of a character by its index."""
    before = text[:index]
    return Place(before.count("\n") + 1, index - before.rfind("\n"))


def _excerpt(text: str, place: Place) -> str:
    """Return a line, or the part of a long line around a place, with a caret below."""
    begin = max(place.column - _EXCERPT // 2, 0)
    line = text.split("\n")[place.line - 1][begin:].replace("\t", " ")
    if not line.strip():
        return ""
    return f"\n    {one_line(line, _EXCERPT).rstrip()}\n    {'^':>{place.column - begin}}"


class _Builder:
    """Builds the tree from parser events, no deeper than `MAX_DEPTH` levels."""

    def __init__(self, text: str) -> None:
        if tab := _TAB.search(text):
            raise _RefusalError(tab.end() - 1, "a tab; use blanks")
        self.events: Iterator[Any] = yaml.parse(text, Loader=yaml.SafeLoader)
        self.anchors: dict[str, tuple[Node, int]] = {}
        self.nodes = 0

    def build(self) -> Node:
        documents = self._list(yaml.StreamEndEvent, -1)
        if not documents:
            raise _RefusalError(0, "the file is empty; begin with protocol: 1")
        return documents[0]

    def _list(self, end: type[Any], depth: int) -> list[Node]:
        """Return the nodes up to the event that closes them."""
        nodes: list[Node] = []
        for event in self.events:
            at = event.start_mark.index
            if isinstance(event, end):
                break
            if isinstance(event, yaml.DocumentStartEvent) and nodes:
                raise _RefusalError(at, "a second document; a file has one protocol")
            if isinstance(event, yaml.NodeEvent):
                nodes.append(self._node(event, depth + 1))
        return nodes

    def _node(self, event: Any, depth: int) -> Node:
        node: Node
        at, before, size = event.start_mark.index, self.nodes, 1
        place = Place(event.start_mark.line + 1, event.start_mark.column + 1)
        if isinstance(event, yaml.AliasEvent):
            if event.anchor not in self.anchors:
                name = quote(str(event.anchor))
                raise _RefusalError(at, f"no anchor stands before the alias {name}")
            node, size = self.anchors[event.anchor]
        elif event.tag is not None:
            raise _RefusalError(at, f"the tag {quote(event.tag)} is not accepted; leave it out")
        elif isinstance(event, yaml.ScalarEvent):
            # "\uD800" in double quotes is a lone surrogate, which no file or database accepts.
            if any("\ud800" <= character <= "\udfff" for character in event.value):
                raise _RefusalError(at, "half of a surrogate pair; write the character itself")
            node = ScalarNode(event.value, event.style is None, place)
        elif depth >= MAX_DEPTH:
            raise _RefusalError(at, f"more than {MAX_DEPTH} levels of brackets or indents")
        elif isinstance(event, yaml.SequenceStartEvent):
            node = Sequence(place, self._list(yaml.SequenceEndEvent, depth))
        else:
            parts = self._list(yaml.MappingEndEvent, depth)
            node = Mapping(place, list(zip(parts[::2], parts[1::2], strict=True)))
        # Items of a list were counted when read; those of an alias are counted here.
        self.nodes += size
        if self.nodes > MAX_NODES:
            raise _RefusalError(at, f"more than {MAX_NODES} values, aliases expanded")
        if event.anchor:
            self.anchors[event.anchor] = node, self.nodes - before
        return node
