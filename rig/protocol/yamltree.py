"""YAML parser that returns a tree whose nodes have line and column.

The tree is made from PyYAML's nodes, not from its values. So no tag can create an object, scalars
remain text, repeated keys can be reported, and depth and size are bounded: no file can exhaust
stack or memory.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import count
from typing import Any, NamedTuple, cast

import yaml

from rig.errors import InputError, Problem
from rig.printable import one_line
from rig.text_rows import read_rows
from rig.units import quote

MAX_DEPTH = 32
MAX_NODES = 10_000
_BREAK = re.compile(r"\r\n|[\n\r\x85\u2028\u2029]")
"""Line breaks of YAML 1.1, section 5.4, by which PyYAML counts lines."""
_TAB = re.compile(r"^[^\t#\n]*\t", re.MULTILINE)
"""A tab outside comments, which YAML accepts only in some places."""
_EXCERPT = 72  # columns of a terminal of 80, less an indent

_CORE = {kind: re.compile(pattern) for kind, pattern in read_rows(__file__, mark=" / ")}
"""Scalars of the core schema, see ``yamltree.txt``."""


class Place(NamedTuple):
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
        kinds = (kind for kind, pattern in _CORE.items() if pattern.fullmatch(self.text))
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
    """A mapping; entries in file order, repeated keys included.

    `partial` if further keys are not known: those that a chain takes over from a faulty one.
    """

    place: Place
    entries: list[tuple[Node, Node]]
    partial: bool = False

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
        return _compose(body)
    except _RefusalError as refusal:
        index, message = refusal.args
    except yaml.reader.ReaderError as error:
        index = error.position
        message = f"control character U+{ord(body[index]):04X}; write plain text only"
    except yaml.MarkedYAMLError as error:
        from rig.protocol.yamlmend import explain  # noqa: PLC0415 - only a mistake needs it

        index, message = explain(body, error)
    except (yaml.YAMLError, ValueError, ArithmeticError, LookupError, RecursionError):
        # The parser leaks int() and chr() errors of broken escapes and directives.
        index, message = 0, "this file cannot be read; see its quotes, brackets and % lines"
    place = place_at(body, index)
    problem = Problem(source, *place, "", message, _excerpt(body, place))
    raise InputError(problems=[problem])


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


class _Composer(yaml.BaseLoader):
    """PyYAML's composer of nodes, which have a tag only where the file has one; bounded."""

    nodes = depth = 0

    def resolve(self, *_: object) -> None:
        """Leave the type of a node to its reader."""

    def compose_node(self, *place: Any) -> Any:
        """Compose a node; an anchor may be given again (YAML 1.2, 3.2.2.2)."""
        event = cast("Any", self).peek_event()
        self.nodes += 1
        _check_size(event, self.nodes, self.depth)
        if tag := getattr(event, "tag", None):
            message = f"the tag {quote(tag)} is not accepted; leave it out"
            raise _RefusalError(event.start_mark.index, message)
        if not isinstance(event, yaml.AliasEvent):
            self.anchors.pop(event.anchor, None)
        self.depth += 1
        node = super().compose_node(*place)
        self.depth -= 1
        return node


def _check_size(place: Any, nodes: int, depth: int) -> None:
    """Raise an error at the event or node that is too many, or too deep."""
    if nodes > MAX_NODES or depth > MAX_DEPTH:
        limits = f"{MAX_NODES} values, aliases expanded, or {MAX_DEPTH} levels"
        raise _RefusalError(place.start_mark.index, f"more than {limits} of brackets or indents")


def _compose(text: str) -> Node:
    """Return the tree of a text with plain line breaks."""
    if tab := _TAB.search(text):
        raise _RefusalError(tab.end() - 1, "a tab; use blanks")
    root = yaml.compose(text, Loader=_Composer)
    if root is None:
        raise _RefusalError(0, "the file is empty; begin with protocol: 1")
    return _translate(root, count(1), 0)


def _translate(node: Any, numbers: Iterator[int], depth: int) -> Node:
    """Return the tree below a node; `numbers` counts its nodes, those of an alias again."""
    _check_size(node, next(numbers), depth)
    place = Place(node.start_mark.line + 1, node.start_mark.column + 1)
    if isinstance(node, yaml.ScalarNode):
        # "\uD800" in double quotes is a lone surrogate, which no file or database accepts.
        if any("\ud800" <= character <= "\udfff" for character in node.value):
            message = "half of a surrogate pair; write the character itself"
            raise _RefusalError(node.start_mark.index, message)
        return ScalarNode(node.value, node.style is None, place)
    inner = partial(_translate, numbers=numbers, depth=depth + 1)
    if isinstance(node, yaml.SequenceNode):
        return Sequence(place, [*map(inner, node.value)])
    return Mapping(place, [(inner(key), inner(value)) for key, value in node.value])
