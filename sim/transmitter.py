"""The virtual board's side of the wire: bytes out at line rate, and when they arrive."""

from __future__ import annotations

from collections import deque

from rig.link import messages as wire
from rig.link.frames import Frame, encode

_BITS_PER_BYTE = 10  # start, eight, stop


class Transmitter:
    """Sends one frame after the other, like a polled UART.

    Parameters
    ----------
    baudrate
        Bits a second.

    Attributes
    ----------
    byte_ns
        How long a byte takes.
    free_ns
        When the last frame will be out.
    """

    def __init__(self, baudrate: int) -> None:
        self.byte_ns = _BITS_PER_BYTE * 10**9 // baudrate
        self.free_ns = 0
        self._seq = 0
        self._out: deque[tuple[int, bytes]] = deque()  # when the first byte begins, and the rest

    def frame(self, message: wire.DeviceMessage, ack: int) -> bytes:
        """Make the next frame."""
        self._seq = self._seq % 255 + 1
        code, payload = wire.pack(message)
        return encode(Frame(code, self._seq, ack, payload))

    def send(self, at_ns: int, data: bytes) -> None:
        """Queue bytes behind what is being sent."""
        start = max(at_ns, self.free_ns)
        self._out.append((start, data))
        self.free_ns = start + len(data) * self.byte_ns

    def next_arrival_ns(self) -> int | None:
        """Say when the host gets the next byte."""
        return self._out[0][0] + self.byte_ns if self._out else None

    def read(self, now_ns: int) -> bytes:
        """Take what has reached the host by now."""
        got = b""
        while self._out:
            start, data = self._out[0]
            count = min(len(data), max(0, (now_ns - start) // self.byte_ns))
            got += data[:count]
            if count < len(data):
                self._out[0] = (start + count * self.byte_ns, data[count:])
                break
            self._out.popleft()
        return got

    def clear(self, now_ns: int) -> None:
        """Forget everything, as a reset does."""
        self._out.clear()
        self._seq = 0
        self.free_ns = now_ns
