"""Ctrl-C, SIGTERM and STOP: how what is under way is ended without tearing a record apart."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager

from rig.ctrl_c import signals_go_to

_PATIENCE = 3


class Interrupts:
    """Turns both signals into `KeyboardInterrupt` where somebody waits, and nowhere else.

    An exception that may strike between any two instructions would now and then strike between an
    answer and what follows from it. A signal is only noted; the exception comes where waiting is
    `let_through`, or at the end. Whoever asks a third time is obeyed at once: a port may hang for
    good.
    """

    _is_let_through = False
    _asked = 0

    @contextmanager
    def caught(self) -> Iterator[None]:
        """Take both signals for the time of a block; only in the main thread."""
        with signals_go_to(self._note, signal.SIGINT, signal.SIGTERM):
            yield
        self.check()

    @contextmanager
    def let_through(self) -> Iterator[None]:
        """Obey at once in a block: there is no record to tear."""
        self._is_let_through = True
        try:
            self.check()
            yield
        finally:
            self._is_let_through = False

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
        if self._is_let_through or self._asked >= _PATIENCE:
            self.check()
