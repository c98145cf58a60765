"""The types a message field can have on the wire, and how each is written and read."""

from __future__ import annotations

import struct
import typing
from dataclasses import dataclass, fields
from typing import Annotated, Any, NamedTuple, TypeAlias

from rig.errors import DeviceError


class MessageError(DeviceError, ValueError):
    """A payload that does not fit its message, or a value that does not fit its field."""


@dataclass(frozen=True, slots=True)
class Scalar:
    """An unsigned little-endian integer: its `struct` code and its C type."""

    code: str
    c_type: str

    @property
    def size(self) -> int:
        """Bytes on the wire."""
        return struct.calcsize("<" + self.code)


@dataclass(frozen=True, slots=True)
class Chars:
    """UTF-8 behind a length byte, at most `limit` bytes."""

    limit: int


@dataclass(frozen=True, slots=True)
class Raw:
    """Exactly `size` bytes."""

    size: int


@dataclass(frozen=True, slots=True)
class Tail:
    """Records of the same shape up to the end of the payload; only ever the last field."""

    record: type[tuple[int, ...]]
    scalars: tuple[Scalar, ...]

    @property
    def size(self) -> int:
        """Bytes of one record."""
        return sum(scalar.size for scalar in self.scalars)

    @property
    def layout(self) -> struct.Struct:
        """One record as a `struct`."""
        return struct.Struct("<" + "".join(scalar.code for scalar in self.scalars))


Wire: TypeAlias = Scalar | Chars | Raw | Tail


class Event(NamedTuple):
    """One snapshot: the device's tick (u32) and the gates' state after the change (1 = blocked)."""

    tick: int
    state: int


_BYTE = Scalar("B", "uint8_t")
_WORD = Scalar("H", "uint16_t")
_LONG = Scalar("I", "uint32_t")

U8: TypeAlias = Annotated[int, _BYTE]
U16: TypeAlias = Annotated[int, _WORD]
U32: TypeAlias = Annotated[int, _LONG]
UniqueId: TypeAlias = Annotated[bytes, Raw(8)]
Name: TypeAlias = Annotated[str, Chars(24)]
Line: TypeAlias = Annotated[str, Chars(96)]
Events: TypeAlias = Annotated[tuple[Event, ...], Tail(Event, (_LONG, _WORD))]

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
    found = []
    for field in fields(message):
        python, wire = typing.get_args(hints[field.name])[:2]
        found.append(Field(field.name, python, wire))
    return tuple(found)


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
        match field.wire:
            case Scalar(code=code):
                return struct.pack("<" + code, value)
            case Raw(size=size) if len(value) == size:
                return bytes(value)
            case Chars(limit=limit) if len(value.encode()) <= limit:
                text: bytes = value.encode()
                return bytes((len(text),)) + text
            case Tail() as tail:
                layout = tail.layout
                return b"".join([layout.pack(*record) for record in value])
    except struct.error as error:
        raise MessageError(f"{field.name}={value!r} does not fit: {error}") from error
    raise MessageError(f"{field.name}={value!r} does not fit")


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
        match field.wire:
            case Scalar(code=code, size=size):
                (number,) = struct.unpack_from("<" + code, payload, at)
                return (field.python(number) if field.python is not int else number), at + size
            case Raw(size=size):
                end = at + size
                value: Any = payload[at:end]
            case Chars():
                end = at + 1 + payload[at]
                value = payload[at + 1 : end].decode()
            case Tail() as tail:
                end = len(payload)
                value = tuple(map(tail.record._make, tail.layout.iter_unpack(payload[at:])))  # type: ignore[attr-defined]
    except (struct.error, IndexError, ValueError) as error:
        raise MessageError(f"bad {field.name}: {error}") from error
    if end > len(payload):
        raise MessageError(f"payload ends within {field.name}")
    return value, end
