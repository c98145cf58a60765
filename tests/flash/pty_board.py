"""A virtual board behind a real serial device: a pseudo-terminal that any program can open."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

from serial.tools.list_ports_common import ListPortInfo

from sim.board import VirtualBoard
from sim.terminal import Terminal
from tests.link.bench import ScriptedLab

_LOOK_S = 0.005


@contextmanager
def silent_port() -> Iterator[str]:
    """Open a port behind which nobody answers."""
    ends = os.openpty()
    yield os.ttyname(ends[1])
    for end in ends:
        os.close(end)


def info(path, vid=None, pid=None, serial_number=None, product=None) -> ListPortInfo:
    """Describe a port as pyserial finds it."""
    found = ListPortInfo(path)
    found.vid, found.pid = vid, pid
    found.serial_number, found.product = serial_number, product
    return found


class PtyBoard:
    """Runs a virtual board in real time behind `path`, as long as it is entered.

    A pseudo-terminal has no DTR, so nothing restarts the board when the port is opened; it boots
    once, at the beginning.
    """

    def __init__(self, lab: ScriptedLab | None = None, **names: object) -> None:
        self._board = VirtualBoard(lab or ScriptedLab(), seed=1)
        self._board.identity = replace(self._board.identity, **names)
        self._board.reset(0)
        self._terminal = Terminal()
        self.path = self._terminal.path
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def __enter__(self) -> PtyBoard:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()
        self._terminal.pull()

    def _run(self) -> None:
        begun = time.monotonic_ns()
        while not self._over.is_set():
            self._terminal.wait(_LOOK_S)
            now = time.monotonic_ns() - begun
            self._board.receive(now, self._terminal.read())
            self._board.advance(now)
            self._terminal.write(self._board.line.read(now))
