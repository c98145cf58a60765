"""Single frames with any seq, good or bad, and the moments at which answers come."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, NamedTuple

from rig.link import messages as wire
from rig.link.frames import Decoder, Frame, encode

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rig.clock.host import Clock
    from rig.link.port import Port


class Heard(NamedTuple):
    """One message of the device; `ack` is 0 when it came unasked."""

    at_ns: int
    ack: int
    message: wire.Message


class RawLine:
    """A port without any of the client's courtesies: nothing is repeated, nothing is added.

    Parameters
    ----------
    port, clock
        The open port and its time.
    """

    def __init__(self, port: Port, clock: Clock) -> None:
        self.port = port
        self.clock = clock
        self._decoder = Decoder()
        self._waiting: deque[Heard] = deque()  # came together with what somebody waited for

    def send(self, code: int, payload: bytes, seq: int) -> None:
        """Send a frame, be it a message or not."""
        self.port.write(encode(Frame(code, seq, 0, payload)))

    def say(self, message: wire.Message, seq: int) -> None:
        """Send a message."""
        self.send(*wire.pack(message), seq)

    def listen(self, seconds: float) -> Iterator[Heard]:
        """Give messages as they come, until the time is over.

        Raises
        ------
        MessageError
            A frame that is no message.
        """
        end = self.clock.now_ns() + round(seconds * 1e9)
        while True:
            while self._waiting:
                yield self._waiting.popleft()
            if self.clock.now_ns() >= end:
                return
            for frame in self._decoder.feed(self.port.read(max(1, self.port.in_waiting))):
                message = wire.unpack(frame.type, frame.payload)
                self._waiting.append(Heard(self.clock.now_ns(), frame.ack, message))
