"""The types a message field can have on the wire, and how each is written and read."""

from __future__ import annotations

import struct
import typing
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Annotated, Any, NamedTuple, TypeAlias

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
        """One record as a `struct`, without padding."""
        return struct.Struct("<" + "".join(scalar.code for scalar in self.scalars))

    @property
    def size(self) -> int:
        """Bytes of one record."""
        return self.layout.size

    def pack(self, events: Iterable[tuple[int, int]]) -> bytes:
        """Write events."""
        return b"".join([self.layout.pack(*event) for event in events])

    def unpack(self, payload: bytes, at: int) -> tuple[tuple[Event, ...], int]:
        """Read all that is left."""
        return tuple(map(Event._make, self.layout.iter_unpack(payload[at:]))), len(payload)


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


def read_payload(fields: Iterable[Field], payload: bytes) -> list[Any]:
    """Read the values of all fields of a message.

    Parameters
    ----------
    fields
        Of the message, in wire order.
    payload
        The whole payload.

    Raises
    ------
    MessageError
        When the payload ends too soon or too late, or a value is not one of its field's.
    """
    values, at = list[Any](), 0
    for field in fields:
        try:
            value, at = field.wire.unpack(payload, at)
            values.append(field.python(value) if isinstance(field.wire, Unsigned) else value)
        except (struct.error, IndexError, ValueError) as error:
            raise MessageError(f"bad {field.name}: {error}") from error
    if at != len(payload):
        raise MessageError(f"{len(payload) - at} bytes too many")
    return values
