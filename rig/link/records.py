"""Records of one shape behind each other, kept as the bytes they are on the wire."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, overload

if TYPE_CHECKING:
    from typing import SupportsIndex


@dataclass(frozen=True, slots=True)
class Scalar:
    """An unsigned little-endian integer: its `struct` code and its C type."""

    code: str
    c_type: str

    @property
    def size(self) -> int:
        """Bytes on the wire."""
        return struct.calcsize("<" + self.code)


def layout(scalars: Iterable[Scalar]) -> struct.Struct:
    """Put numbers behind each other, without padding."""
    return struct.Struct("<" + "".join(scalar.code for scalar in scalars))


class Event(NamedTuple):
    """One snapshot: the device's tick (u32) and the gates' state after the change (1 = blocked)."""

    tick: int
    state: int


@dataclass(frozen=True)
class Tail:
    """Events up to the end of the payload; only ever the last field."""

    scalars: tuple[Scalar, ...]

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
