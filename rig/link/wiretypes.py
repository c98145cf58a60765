"""The types a message field can have on the wire, and how each is written and read."""

from __future__ import annotations

import struct
import typing
from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import takewhile
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

from rig.errors import DeviceError
from rig.link.records import Event, Events, Scalar, Tail, layout

if TYPE_CHECKING:
    from collections.abc import Callable


class MessageError(DeviceError, ValueError):
    """A payload that does not fit its message, or a value that does not fit its field."""


@dataclass(frozen=True, slots=True)
class Chars:
    """UTF-8 behind a length byte, at most `limit` bytes."""

    limit: int


@dataclass(frozen=True, slots=True)
class Raw:
    """Exactly `size` bytes."""

    size: int


Wire: TypeAlias = Scalar | Chars | Raw | Tail


_BYTE = Scalar("B", "uint8_t")
_WORD = Scalar("H", "uint16_t")
_LONG = Scalar("I", "uint32_t")

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
                return tail.pack(value)
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
                value = Events(tail, payload[at:])
    except (struct.error, IndexError, ValueError) as error:
        raise MessageError(f"bad {field.name}: {error}") from error
    if end > len(payload):
        raise MessageError(f"payload ends within {field.name}")
    return value, end


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
    scalars = [f.wire for f in takewhile(lambda f: isinstance(f.wire, Scalar), fields)]
    head = layout([wire for wire in scalars if isinstance(wire, Scalar)])
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
