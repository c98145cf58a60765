"""STOP's own way to the wire: a thread that waits for no disk and for nothing that is under way."""

from __future__ import annotations

import threading
from collections.abc import Callable

_TIMES = 5
_AGAIN_S = 0.03
"""As an ABORT of the worker is repeated: all within the 250 ms after which everything is off."""
_ASIDE_S = 0.005
"""How long whoever asks stands aside: beside threads that compute, the one that sends would have to
wait until Python gives it a turn."""


class Stopper:
    """Sends ABORT as soon as it is asked for, and again until the worker has taken over.

    Parameters
    ----------
    send
        Writes one ABORT to the port, from this thread; `False` when there is none to write to.
    """

    def __init__(self, send: Callable[[], bool]) -> None:
        self._send = send
        self._asked = threading.Event()
        self._taken_over = threading.Event()
        self._left = threading.Event()
        self._ending = False
        self._thread = threading.Thread(target=self._run, name="rig stop", daemon=True)

    def start(self) -> None:
        """Wait for the first."""
        self._thread.start()

    def ask(self) -> None:
        """Have everything switched off, now."""
        self._taken_over.clear()
        self._left.clear()
        self._asked.set()
        self._left.wait(_ASIDE_S)

    def taken_over(self) -> None:
        """Note that the worker is at it, which also hears the answers."""
        self._taken_over.set()

    def end(self) -> None:
        """Send no more; a port that takes no bytes may hold the thread until the process ends."""
        self._ending = True
        self._taken_over.set()
        self._asked.set()

    def _run(self) -> None:
        while self._asked.wait() and not self._ending:
            self._asked.clear()
            for _ in range(_TIMES):
                unsent = self._send()
                self._left.set()
                if not unsent or self._taken_over.wait(_AGAIN_S):
                    break
