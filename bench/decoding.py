"""Frames of edges, and how fast they are decoded: by the link, and byte by byte."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from rig.link.frames import Frame, crc16, encode
from rig.link.messages import (
    EVENTS_PER_FRAME,
    Arm,
    Armed,
    EventsFrame,
    Fire,
    Fired,
    pack,
    pack_events,
    pack_label,
)
from rig.link.transcript import Transcript

if TYPE_CHECKING:
    from collections.abc import Callable

    from rig.link.messages import Message

LABEL = pack_label(1, 1)
TICKS = 3200  # from one edge to the next: 5000 edges/s at 16 MHz
_CHUNK = 4096  # as a busy port gives them
_BEST_OF = 5


def frames(count: int) -> list[bytes]:
    """Make EVENTS frames of one drop; each event is one edge of gate 0."""
    made = []
    for number in range(count):
        first = number * EVENTS_PER_FRAME
        numbers = range(first, first + EVENTS_PER_FRAME)
        events = pack_events((n * TICKS % 2**32, (n + 1) % 2) for n in numbers)
        made.append(_framed(EventsFrame(LABEL, first, events), number % 255 + 1))
    return made


def _framed(message: Message, seq: int, ack: int = 0) -> bytes:
    code, payload = pack(message)
    return encode(Frame(code, seq, ack, payload))


def fired() -> Transcript:
    """Make a transcript in which the drop of `frames` has just been fired, at tick 0."""
    transcript = Transcript()
    transcript.feed("tx", 0, _framed(Arm(LABEL, 0xFFFF, 0, 0, 0, 0), 1))
    transcript.feed("rx", 0, _framed(Armed(7), 1, ack=1))
    transcript.feed("tx", 0, _framed(Fire(7), 2))
    transcript.feed("rx", 0, _framed(Fired(0), 2, ack=2))
    return transcript


def checked(data: bytes) -> Transcript:
    """Decode a stream as far as the live link does: into the drop's record, in which none lacks."""
    transcript = fired()
    for at in range(0, len(data), _CHUNK):
        transcript.feed("rx", 0, data[at : at + _CHUNK])
    return transcript


def to_edges(data: bytes) -> list[tuple[int, int, bool]]:
    """Decode a stream to edges as the analysis gets them, s ticks since the release."""
    return list(checked(data).pending(LABEL).edges)


def bytewise(data: bytes) -> list[tuple[int, int, bool]]:
    """Decode a stream as pyFirmata and telemetrix do: one byte at a time, state in between."""
    edges: list[tuple[int, int, bool]] = []
    body = bytearray()
    left, joint, state = 0, False, 0
    for byte in data:
        if byte == 0:
            if len(body) > 5 and crc16(bytes(body[:-2])) == body[-2] | body[-1] << 8:
                for at in range(9, len(body) - 2, 6):
                    tick = body[at] | body[at + 1] << 8 | body[at + 2] << 16 | body[at + 3] << 24
                    now = body[at + 4] | body[at + 5] << 8
                    for channel in range(16):
                        if (state ^ now) >> channel & 1:
                            edges.append((tick, channel, bool(now >> channel & 1)))  # noqa: PERF401
                    state = now
            body.clear()
            left, joint = 0, False
        elif left:
            body.append(byte)
            left -= 1
        else:
            if joint:
                body.append(0)
            left, joint = byte - 1, byte != 0xFF
    return edges


def speed(decode: Callable[[bytes], object], count: int) -> float:
    """Edges a second of a processor's own time, best of a few: others may be using it too.

    Parameters
    ----------
    decode
        One of the above.
    count
        Frames to decode.
    """
    data = b"".join(frames(count))
    taken = []
    for _ in range(_BEST_OF):
        begun = time.process_time()
        decode(data)
        taken.append(time.process_time() - begun)
    return count * EVENTS_PER_FRAME / min(taken)
