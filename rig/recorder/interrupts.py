"""Ctrl-C, SIGTERM and STOP: how what is under way is ended without tearing a record apart."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager

from rig.errors import DeviceError

_PATIENCE = 3


class StoppedError(DeviceError):
    """A client pressed STOP, or the one in control was lost."""


class Interrupts:
    """Turns both signals into `KeyboardInterrupt` at moments when nothing is torn apart by it.

    An exception that may strike between any two instructions would now and then strike between a
    byte and the log of it, or between a row and its count. Inside `held` a signal is only noted;
    the exception comes at the end of the block. Whoever asks a third time is obeyed at once: a
    port may hang for good.
    """

    def __init__(self) -> None:
        self._held = 0
        self._asked = 0

    @contextmanager
    def caught(self) -> Iterator[None]:
        """Take both signals for the time of a block; only in the main thread."""
        before = {
            number: signal.signal(number, self._note)
            for number in (signal.SIGINT, signal.SIGTERM)
            # A shell starts what runs in the background with Ctrl-C ignored, and means it.
            if signal.getsignal(number) is not signal.SIG_IGN
        }
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    @contextmanager
    def held(self) -> Iterator[None]:
        """Keep signals waiting until the end of the block; blocks may stand inside each other."""
        self._held += 1
        try:
            yield
        finally:
            self._held -= 1
        if not self._held:
            self.check()

    def check(self) -> None:
        """Raise what is waiting.

        Raises
        ------
        KeyboardInterrupt
            If a signal came and was not raised yet.
        """
        if self._asked:
            self._asked = 0
            raise KeyboardInterrupt

    def _note(self, *_: object) -> None:
        self._asked += 1
        if not self._held or self._asked >= _PATIENCE:
            self.check()
