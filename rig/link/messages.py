"""The wire's one table: every message, its code, its fields in order.

The codec below and the firmware's C header both come from these definitions; nothing about the
wire is written down a second time. Host requests have codes below 0x80, device frames above.

How a drop goes: ARM → ARMED(token) → FIRE(token) → FIRED, then EVENTS as they come and a
CERTIFICATE when `record_ms` is over. The device holds the drop until ACKNOWLEDGE names its label
and CRC; until then READ gives any part of it again. A device that `streams` has memory for the
latest `capacity` events only, and refuses to read older ones with NOT_KEPT.

While armed, the host must be heard at least every `HOST_SILENCE_MS`; from FIRE until the
certificate it keeps silent, so that nothing but gates interrupts the device.

Rules for a device: a frame that cannot be read, or with seq 0, is passed over in silence. A request
with the type, seq and CRC of the one before it is a repeat (its answer was lost): ARMED, FIRED,
DONE and REFUSED are then sent again without executing anything; answers that change nothing may
simply be made anew. All gates of ARM must be clear then and at FIRE, so `initial_state` of the
armed gates is 0; the other gates are left out of every event.
"""

import struct
import typing
from collections.abc import Iterable
from dataclasses import asdict, dataclass, fields
from enum import IntEnum
from functools import cache
from itertools import starmap
from typing import Annotated, Any, NamedTuple, TypeAlias, dataclass_transform

from rig.boards import GATES, Capabilities
from rig.errors import DeviceError
from rig.link.frames import PAYLOAD_LIMIT
from rig.records import Job

PROTOCOL_VERSION = 2
HOST_SILENCE_MS = 250
"""An armed device that heard no request for so long disarms itself."""
TEST_RUN = 0
"""The run in the labels of drops that belong to no session: plans count from 1."""


class MessageError(DeviceError, ValueError):
    """A payload that does not fit its message, or a value that does not fit its field."""


class Event(NamedTuple):
    """One snapshot: the device's tick (u32) and the gates' state after the change (1 = blocked)."""

    tick: int
    state: int


EVENT = struct.Struct("<IH")
"""An `Event` on the wire."""
EVENTS_PER_FRAME = PAYLOAD_LIMIT // EVENT.size - 1
"""Events that fit into an EVENTS frame, whose label and index take the place of one."""


def pack_events(events: Iterable[tuple[int, int]]) -> bytes:
    """Write ticks and states as they stand in a frame; one that does not fit is a struct.error."""
    return b"".join(starmap(EVENT.pack, events))


@cache
def channels_of(mask: int) -> list[int]:
    """List the channels of a mask of gates."""
    return [n for n in range(GATES) if mask >> n & 1]


class UnsignedInt(NamedTuple):
    """An unsigned little-endian integer of `size` bytes."""

    size: int

    def pack(self, value: int) -> bytes:
        """Write a value."""
        return value.to_bytes(self.size, "little")

    def unpack(self, payload: bytes, at: int) -> tuple[int, int]:
        """Read a value; give where the next one starts, too."""
        value, end = Raw(self.size).unpack(payload, at)
        return int.from_bytes(value, "little"), end


class Raw(NamedTuple):
    """Exactly `size` bytes; as a tail, any number of them up to the end of the payload."""

    size: int
    tail: bool = False

    def pack(self, value: bytes) -> bytes:
        """Write whole records."""
        if len(value) % self.size if self.tail else len(value) != self.size:
            raise ValueError(f"{len(value)} bytes of records of {self.size}")
        return bytes(value)

    def unpack(self, payload: bytes, at: int) -> tuple[bytes, int]:
        """Read a value, or all that is left; give where the next one starts, too."""
        end = len(payload) if self.tail else at + self.size
        return self.pack(payload[at:end]), end


class Chars(NamedTuple):
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


_BYTE = UnsignedInt(1)

U8: TypeAlias = Annotated[int, _BYTE]
U16: TypeAlias = Annotated[int, UnsignedInt(2)]
U32: TypeAlias = Annotated[int, UnsignedInt(4)]
Name: TypeAlias = Annotated[str, Chars(24)]
Line: TypeAlias = Annotated[str, Chars(96)]


class Field(NamedTuple):
    """One field of a message: its name, Python type and wire type."""

    name: str
    python: type
    wire: UnsignedInt | Chars | Raw


class Phase(IntEnum):
    """What the device is doing."""

    IDLE = 0
    ARMED = 1
    RECORDING = 2
    HOLDING = 3


class RefusalReason(IntEnum):
    """Why a request was refused; `Refused.detail` says more where noted."""

    NOT_ARMED = 1
    WRONG_TOKEN = 2
    GATE_BLOCKED = 3  # detail: mask of the blocked gates
    GATE_UNSTEADY = 4  # detail: mask of the gates that changed since ARM
    BAD_PARAMETER = 5
    BUSY = 6
    HOLDING_A_DROP = 7  # detail: its run
    NO_SUCH_DROP = 8
    WRONG_CRC = 9
    VERSION = 10  # detail: the device's protocol version
    UNKNOWN_MESSAGE = 11  # detail: its code
    STOPPED = 12  # the emergency stop is open
    COOLING = 13  # the release was on too much; detail: milliseconds still to wait
    NOT_KEPT = 14  # detail: number of the first event that can still be read


class DisarmReason(IntEnum):
    """Why the device disarmed by itself."""

    TIMEOUT = 1
    HOST_SILENT = 2
    STOPPED = 3


class PulseEnd(IntEnum):
    """What ended the release's pulse."""

    ORDERED = 0  # its own length, or the recording's end: as ARM said
    STOPPED = 1
    ABORTED = 2
    DEVICE = 3  # the device, to be safe: its main loop stood still, or the pin did not obey


TABLE: dict[int, type["Message"]] = {}
"""Every message by its code."""


@dataclass_transform(frozen_default=True)
class Message:
    """A request or an answer; a class that has a code is entered into the table."""

    def __init_subclass__(cls, code: int | None = None) -> None:
        dataclass(frozen=True)(cls)
        if code is not None:
            TABLE[code] = cls


class HostMessage(Message):
    """A request."""


class DeviceMessage(Message):
    """An answer, or what the device says of its own accord."""


class Identify(HostMessage, code=0x01):
    """Ask who is there; the first request on a line."""

    protocol_version: U8 = PROTOCOL_VERSION


class Ping(HostMessage, code=0x02):
    """Ask for the device's tick."""


class Status(HostMessage, code=0x03):
    """Ask what the device is doing."""


class Arm(HostMessage, code=0x04):
    """Prepare a drop.

    Attributes
    ----------
    label
        Run and attempt, see `pack_label`; never 0.
    gates
        Mask of the gates that count: they must be clear now and until FIRE.
    release
        Mask of the release outputs to pulse; 0 when something else lets go.
    pulse_us
        How long to pulse them.
    timeout_ms
        The device disarms itself when no FIRE came for so long.
    record_ms
        How long after FIRE to record.
    """

    label: U32
    gates: U16
    release: U8
    pulse_us: U32
    timeout_ms: U16
    record_ms: U16


class Fire(HostMessage, code=0x05):
    """Let go; `token` is from ARMED, so that no stray frame can fire."""

    token: U32


class Abort(HostMessage, code=0x06):
    """Switch the release off; disarm; end a recording now. A held drop may then be re-armed."""


class Read(HostMessage, code=0x07):
    """Ask for events again (answer EVENTS, perhaps fewer); count 0 asks for the CERTIFICATE."""

    label: U32
    first: U16
    count: U8


class Acknowledge(HostMessage, code=0x08):
    """The drop is safe with the host: the device may forget it."""

    label: U32
    crc32: U32


class Reference(HostMessage, code=0x09):
    """Ask for the latest pulse of the 1 Hz reference."""


class Flash(HostMessage, code=0x0A):
    """Start the program that takes firmware; a board without one does not know this request."""


class Identity(DeviceMessage, code=0x81):
    """Who the device is and what it can do.

    Attributes
    ----------
    capacity
        Events it can keep.
    streams
        1 when it keeps the latest events only, 0 when it keeps a drop whole.
    late_ticks
        A stamp that follows the one before it within so many ticks may be late by as much.
    channels
        Names of the gate inputs, separated by spaces.
    """

    protocol_version: U8
    board: Name
    firmware: Name
    unique_id: Annotated[bytes, Raw(8)]
    tick_hz: U32
    gates: U8
    releases: U8
    max_pulse_us: U32
    capacity: U16
    streams: U8
    late_ticks: U16
    channels: Line

    def json(self) -> dict[str, Any]:
        """Return it as JSON has it."""
        return asdict(self) | {"unique_id": self.unique_id.hex()}

    def capabilities(self) -> Capabilities:
        """What this board can do, as it says itself."""
        pulse_s, streams = self.max_pulse_us / 1e6, bool(self.streams)
        return Capabilities(self.board, self.gates, self.releases, pulse_s, self.capacity, streams)


class Pong(DeviceMessage, code=0x82):
    """The tick when PING was executed."""

    tick: U32


class State(DeviceMessage, code=0x83):
    """What the device is doing; `label` 0 and `events` 0 when idle."""

    phase: Annotated[Phase, _BYTE]
    gates: U16
    label: U32
    events: U16

    @property
    def drop(self) -> Job | None:
        """The drop that it records or holds; `None` where there is none."""
        has_drop = self.phase in {Phase.RECORDING, Phase.HOLDING}
        return unpack_label(self.label) if has_drop else None


class Armed(DeviceMessage, code=0x84):
    """Answer to ARM."""

    token: U32


class Fired(DeviceMessage, code=0x85):
    """Answer to FIRE: the tick of the release."""

    tick: U32


class Refused(DeviceMessage, code=0x86):
    """The request was understood and not executed."""

    reason: Annotated[RefusalReason, _BYTE]
    detail: U16


class Done(DeviceMessage, code=0x87):
    """ABORT or ACKNOWLEDGE was executed."""


class EventsFrame(DeviceMessage, code=0x88):
    """Events number `first` and on. Stamps are already corrected for the board's mean latency.

    An event with the state of the one before it is a glitch: a pulse over before it was looked at.
    They stay as they are on the wire: a drop is made of many frames and needs few of their numbers.
    """

    label: U32
    first: U16
    events: Annotated[bytes, Raw(EVENT.size, tail=True)]

    @property
    def snapshots(self) -> tuple[Event, ...]:
        """The events, one by one."""
        return tuple(map(Event._make, EVENT.iter_unpack(self.events)))


class DropCertificate(DeviceMessage, code=0x89):
    """The device's own account of a drop, as version 1 sent it.

    Attributes
    ----------
    crc32
        Over the events as they are on the wire.
    overflows
        Events for which there was no memory.
    glitches, late
        How many of the events are glitches, and how many have a stamp that may be late.
    sensed, sense_tick
        Whether the release-sense input changed after FIRE, and when first.
    """

    label: U32
    fire_tick: U32
    gates: U16
    initial_state: U16
    events: U16
    crc32: U32
    overflows: U16
    glitches: U16
    late: U16
    sensed: U8
    sense_tick: U32


class Disarmed(DeviceMessage, code=0x8A):
    """The device disarmed by itself."""

    label: U32
    reason: Annotated[DisarmReason, _BYTE]


class Boot(DeviceMessage, code=0x8B):
    """The device has (re)started; `cause` has the AVR's MCUSR bits.

    A delimiter goes before it, since the reset may have cut another frame short.
    """

    cause: U8


class ReferencePulse(DeviceMessage, code=0x8C):
    """Answer to REFERENCE: how many pulses there were, and the tick of the latest."""

    count: U16
    tick: U32


class DropCertificate2(DropCertificate, code=0x8D):
    """The device's own account of a drop.

    Attributes
    ----------
    pulse_ticks
        How long the release was on; 0 without one.
    pulse_end
        What ended it.
    restarts
        0, or 128 and the causes of all restarts since IDENTIFY.
    supply_mv, lowest_mv
        The board's supply at FIRE, and its lowest while recording; 0 where it is not measured.
    """

    pulse_ticks: U32
    pulse_end: Annotated[PulseEnd, _BYTE]
    restarts: U8
    supply_mv: U16
    lowest_mv: U16


def _wire_fields(message: type[Any]) -> tuple[Field, ...]:
    """List a message's fields in wire order."""
    hints = typing.get_type_hints(message, include_extras=True)
    names = [field.name for field in fields(message)]
    return tuple(Field(name, *typing.get_args(hints[name])[:2]) for name in names)


CODES = {message: code for code, message in TABLE.items()}
FIELDS = {message: _wire_fields(message) for message in CODES}


def pack(message: Message) -> tuple[int, bytes]:
    """Write a message.

    Parameters
    ----------
    message
        Any message of the table.

    Returns
    -------
    int, bytes
        Its code and payload.

    Raises
    ------
    MessageError
        When a value does not fit its field.
    """
    payload = b""
    for name, _, wire in FIELDS[type(message)]:
        value = getattr(message, name)
        try:
            payload += wire.pack(value)
        except (OverflowError, ValueError) as error:
            raise MessageError(f"{name}={value!r} does not fit: {error}") from error
    return CODES[type(message)], payload


def unpack(code: int, payload: bytes) -> Message:
    """Read a message.

    Parameters
    ----------
    code, payload
        From a frame.

    Returns
    -------
    Message
        The message.

    Raises
    ------
    MessageError
        When the code is unknown or the payload does not fit it exactly.
    """
    kind = TABLE.get(code)
    if kind is None:
        raise MessageError(f"unknown message code 0x{code:02X}")
    at, values = 0, []
    try:
        for _, python, wire in FIELDS[kind]:
            value, at = wire.unpack(payload, at)
            values.append(python(value))
    except (IndexError, ValueError) as error:
        raise MessageError(f"bad {kind.__name__}: {error}") from error
    if at != len(payload):
        raise MessageError(f"bad {kind.__name__}: {len(payload) - at} bytes too many")
    return kind(*values)


def pack_label(run: int, attempt: int) -> int:
    """Make a drop's label, ``run | attempt << 16``.

    Parameters
    ----------
    run
        The planned run, 0 … 65535.
    attempt
        1 … 65535, so that a label is never 0.

    Returns
    -------
    int
        The label (u32).

    Raises
    ------
    ValueError
        When a number is out of range.
    """
    if not (0 <= run <= 0xFFFF and 1 <= attempt <= 0xFFFF):
        raise ValueError(f"run {run}, attempt {attempt}: at most 65535, attempt at least 1")
    return run | attempt << 16


def unpack_label(label: int) -> Job:
    """Undo `pack_label`.

    Parameters
    ----------
    label
        A drop's label.

    Returns
    -------
    Job
        Run and attempt.
    """
    return Job(label & 0xFFFF, label >> 16)
