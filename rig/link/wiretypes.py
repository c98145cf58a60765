"""The types a message field can have on the wire, and how each is written and read."""

from __future__ import annotations

import struct
import typing
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from itertools import takewhile
from typing import Annotated, Any, NamedTuple, SupportsIndex, TypeAlias, overload

from rig.errors import DeviceError


class MessageError(DeviceError, ValueError):
    """A payload that does not fit its message, or a value that does not fit its field."""


@dataclass(frozen=True, slots=True)
class Unsigned:
    """An unsigned little-endian integer by its `struct` code."""

    code: str

    @property
    def size(self) -> int:
        """Bytes on the wire."""
        return struct.calcsize("<" + self.code)

    def pack(self, value: int) -> bytes:
        """Write a value."""
        return struct.pack("<" + self.code, value)

    def unpack(self, payload: bytes, at: int) -> tuple[int, int]:
        """Read a value; give where the next one starts, too."""
        return struct.unpack_from("<" + self.code, payload, at)[0], at + self.size


def layout(scalars: Iterable[Unsigned]) -> struct.Struct:
    """Put numbers behind each other, without padding."""
    return struct.Struct("<" + "".join(scalar.code for scalar in scalars))


class Event(NamedTuple):
    """One snapshot: the device's tick (u32) and the gates' state after the change (1 = blocked)."""

    tick: int
    state: int


@dataclass(frozen=True)
class Tail:
    """Events up to the end of the payload; only ever the last field."""

    scalars: tuple[Unsigned, ...]

    @cached_property
    def layout(self) -> struct.Struct:
        """One record as a `struct`."""
        return layout(self.scalars)

    @cached_property
    def size(self) -> int:
        """Bytes of one record."""
        return self.layout.size

    def pack(self, events: Iterable[tuple[int, int]]) -> bytes:
        """Write events.

        Raises
        ------
        struct.error
            When a value does not fit.
        """
        if isinstance(events, Events):
            return events.raw
        return b"".join([self.layout.pack(*event) for event in events])

    def unpack(self, payload: bytes, at: int) -> tuple[Events, int]:
        """Read all that is left."""
        return Events(self, payload[at:]), len(payload)

    def rows(self, events: Sequence[Event]) -> Iterable[tuple[int, int]]:
        """Give ticks and states, which is much faster than single `Event`."""
        return self.layout.iter_unpack(events.raw) if isinstance(events, Events) else events


class Events(Sequence[Event]):
    """Events that are read when somebody looks at them; a record is made of many and needs none.

    Parameters
    ----------
    tail
        How they are on the wire.
    raw
        Whole records.

    Raises
    ------
    ValueError
        The last record is cut short.
    """

    __slots__ = ("_tail", "raw")

    def __init__(self, tail: Tail, raw: bytes) -> None:
        if len(raw) % tail.size:
            raise ValueError(f"the last of the {tail.size}-byte records is cut short")
        self._tail = tail
        self.raw = raw

    def __len__(self) -> int:
        return len(self.raw) // self._tail.size

    def __iter__(self) -> Iterator[Event]:
        return map(Event._make, self._tail.layout.iter_unpack(self.raw))

    @overload
    def __getitem__(self, index: SupportsIndex) -> Event: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Event, ...]: ...
    def __getitem__(self, index: Any) -> Any:
        return tuple(self)[index]

    def __eq__(self, other: object) -> bool:
        if isinstance(other, Events):
            return self.raw == other.raw
        return tuple(self) == other

    def __hash__(self) -> int:
        return hash(tuple(self))

    def __repr__(self) -> str:
        return repr(tuple(self))


@dataclass(frozen=True, slots=True)
class Raw:
    """Exactly `size` bytes."""

    size: int

    def pack(self, value: bytes) -> bytes:
        """Write a value."""
        if len(value) != self.size:
            raise ValueError(f"{len(value)} bytes, not {self.size}")
        return bytes(value)

    def unpack(self, payload: bytes, at: int) -> tuple[bytes, int]:
        """Read a value."""
        if at + self.size > len(payload):
            raise ValueError("the payload ends within it")
        return payload[at : at + self.size], at + self.size


@dataclass(frozen=True, slots=True)
class Chars:
    """UTF-8 behind a length byte, at most `limit` bytes."""

    limit: int

    def pack(self, value: str) -> bytes:
        """Write a value."""
        if len(text := value.encode()) > self.limit:
            raise ValueError(f"{len(text)} bytes, at most {self.limit} fit")
        return bytes((len(text),)) + text

    def unpack(self, payload: bytes, at: int) -> tuple[str, int]:
        """Read a value."""
        text, end = Raw(payload[at]).unpack(payload, at + 1)
        return text.decode(), end


Wire: TypeAlias = Unsigned | Chars | Raw | Tail


_BYTE = Unsigned("B")
_WORD = Unsigned("H")
_LONG = Unsigned("I")

U8: TypeAlias = Annotated[int, _BYTE]
U16: TypeAlias = Annotated[int, _WORD]
U32: TypeAlias = Annotated[int, _LONG]
UniqueId: TypeAlias = Annotated[bytes, Raw(8)]
Name: TypeAlias = Annotated[str, Chars(24)]
Line: TypeAlias = Annotated[str, Chars(96)]
EVENTS = Tail((_LONG, _WORD))
EventList: TypeAlias = Annotated[Sequence[Event], EVENTS]

BYTE_ENUM = _BYTE
"""For ``Annotated[SomeIntEnum, BYTE_ENUM]``."""


@dataclass(frozen=True, slots=True)
class Field:
    """One field of a message: its name, Python type and wire type."""

    name: str
    python: type
    wire: Wire


def wire_fields(message: type) -> tuple[Field, ...]:
    """List a message's fields in wire order (what the codec and the C header are made from).

    Parameters
    ----------
    message
        A dataclass whose annotations all carry a wire type.

    Returns
    -------
    tuple of Field
        In the order of definition.
    """
    hints = typing.get_type_hints(message, include_extras=True)
    return tuple(
        Field(field.name, *typing.get_args(hints[field.name])[:2]) for field in fields(message)
    )


def write_field(field: Field, value: Any) -> bytes:
    """Write one value.

    Parameters
    ----------
    field
        Which field.
    value
        Its value.

    Returns
    -------
    bytes
        As on the wire.

    Raises
    ------
    MessageError
        When the value does not fit.
    """
    try:
        return field.wire.pack(value)
    except (struct.error, ValueError) as error:
        raise MessageError(f"{field.name}={value!r} does not fit: {error}") from error


def read_field(field: Field, payload: bytes, at: int) -> tuple[Any, int]:
    """Read one value.

    Parameters
    ----------
    field
        Which field.
    payload
        The whole payload.
    at
        Where the field starts.

    Returns
    -------
    value, int
        The value, and where the next field starts.

    Raises
    ------
    MessageError
        When the payload ends too soon or the value is not one of the field's.
    """
    try:
        value, end = field.wire.unpack(payload, at)
        return field.python(value) if isinstance(field.wire, Unsigned) else value, end
    except (struct.error, IndexError, ValueError) as error:
        raise MessageError(f"bad {field.name}: {error}") from error


def payload_reader(fields: Sequence[Field]) -> Callable[[bytes], list[Any]]:
    """Make what reads a whole payload: numbers at its beginning at once, the rest by `read_field`.

    Parameters
    ----------
    fields
        Of a message.

    Returns
    -------
    callable
        From a payload to the fields' values; raises `MessageError` where `read_field` does, and
        when bytes are left over.
    """
    scalars = [f.wire for f in takewhile(lambda f: isinstance(f.wire, Unsigned), fields)]
    head = layout([wire for wire in scalars if isinstance(wire, Unsigned)])
    names = [(n, f.python) for n, f in enumerate(fields[: len(scalars)]) if f.python is not int]
    rest = fields[len(scalars) :]

    def read(payload: bytes) -> list[Any]:
        try:
            values: list[Any] = [*head.unpack_from(payload)]
            for number, python in names:
                values[number] = python(values[number])
        except (struct.error, ValueError):
            return _one_by_one(fields, payload, [], 0)  # it says which field is wrong
        return _one_by_one(rest, payload, values, head.size)

    return read


def _one_by_one(fields: Sequence[Field], payload: bytes, values: list[Any], at: int) -> list[Any]:
    for field in fields:
        value, at = read_field(field, payload, at)
        values.append(value)
    if at != len(payload):
        raise MessageError(f"{len(payload) - at} bytes too many")
    return values
