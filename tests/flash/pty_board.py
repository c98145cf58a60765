"""A virtual board behind a real serial device: a pseudo-terminal that any program can open."""

from __future__ import annotations

import os
import select
import threading
import time
import tty
from dataclasses import replace
from typing import TYPE_CHECKING

from sim.board import VirtualBoard
from tests.link.bench import ScriptedLab

if TYPE_CHECKING:
    from types import TracebackType

_LOOK_S = 0.005


class PtyBoard:
    """Runs a virtual board in real time behind `path`, as long as it is entered.

    A pseudo-terminal has no DTR, so nothing restarts the board when the port is opened; it boots
    once, at the beginning.
    """

    def __init__(self, **names: object) -> None:
        self._board = VirtualBoard(ScriptedLab(), seed=1)
        self._board.identity = replace(self._board.identity, **names)
        self._board.reset(0)
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        self.path = os.ttyname(self._slave)
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def __enter__(self) -> PtyBoard:
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._over.set()
        self._thread.join()
        os.close(self._master)
        os.close(self._slave)

    def _run(self) -> None:
        begun = time.monotonic_ns()
        while not self._over.is_set():
            readable, _, _ = select.select([self._master], [], [], _LOOK_S)
            now = time.monotonic_ns() - begun
            if readable:
                self._board.receive(now, os.read(self._master, 4096))
            self._board.advance(now)
            os.write(self._master, self._board.line.arrived(now))
