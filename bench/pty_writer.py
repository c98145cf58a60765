"""A raw terminal that another process writes into: a board without a board."""

from __future__ import annotations

import json
import os
import pty
import subprocess
import sys
import tty

_WRITE = """
import json, os, sys, time
far, every_s = int(sys.argv[1]), float(sys.argv[2])
data, at, frames, sent = sys.stdin.buffer.read(), 0, [], []
while at < len(data):
    size = int.from_bytes(data[at : at + 2], "little")
    frames.append(data[at + 2 : at + 2 + size])
    at += 2 + size
begun = time.monotonic()
for number, frame in enumerate(frames):
    left = begun + number * every_s - time.monotonic()
    if every_s and left > 0:
        time.sleep(left)
    sent.append(time.monotonic())
    while frame:
        frame = frame[os.write(far, frame):]
print(json.dumps(sent))
"""


class PtyWriter:
    """A raw terminal, and a process that writes into its far end.

    Parameters
    ----------
    data
        What to write, piece by piece.
    every_s
        Seconds from one piece to the next; 0 for as fast as possible.

    Attributes
    ----------
    path
        Of the end to read from.
    """

    def __init__(self, data: list[bytes], every_s: float) -> None:
        self._far, self._near = pty.openpty()
        tty.setraw(self._near)
        self.path = os.ttyname(self._near)
        self._data = b"".join(len(frame).to_bytes(2, "little") + frame for frame in data)
        self._writer = subprocess.Popen(
            [sys.executable, "-c", _WRITE, str(self._far), str(every_s)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            pass_fds=[self._far],
        )

    def start(self) -> None:
        """Begin to write."""
        assert self._writer.stdin is not None
        self._writer.stdin.write(self._data)
        self._writer.stdin.close()

    def sent(self) -> list[float]:
        """Return when each piece was written, s (monotonic)."""
        assert self._writer.stdout is not None
        times: list[float] = json.loads(self._writer.stdout.read())
        self._writer.wait()
        self._writer.stdout.close()
        return times

    def close(self) -> None:
        """Hang up."""
        os.close(self._far)
        os.close(self._near)
