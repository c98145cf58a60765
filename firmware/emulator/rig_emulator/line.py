# SPDX-License-Identifier: GPL-3.0-or-later
"""The emulated board's bytes on their way to the host."""

from __future__ import annotations

from collections import deque


class LineToHost:
    """Bytes with the moments at which their stop bits are over.

    Parameters
    ----------
    baudrate
        Bits a second.
    """

    def __init__(self, baudrate: int) -> None:
        self.byte_ns = 10 * 10**9 // baudrate
        self._coming: deque[tuple[int, int]] = deque()

    def put(self, when_ns: int, value: int) -> None:
        """Add a byte behind all others."""
        self._coming.append((when_ns, value))

    def cut(self, now_ns: int) -> None:
        """Lose what is not complete by now, as a reset does."""
        while self._coming and self._coming[-1][0] > now_ns:
            self._coming.pop()

    def next_arrival_ns(self) -> int | None:
        """Say when the host gets the next byte, as far as is known."""
        return self._coming[0][0] if self._coming else None

    def read(self, now_ns: int) -> bytes:
        """Take what has reached the host by now."""
        got = bytearray()
        while self._coming and self._coming[0][0] <= now_ns:
            got.append(self._coming.popleft()[1])
        return bytes(got)
