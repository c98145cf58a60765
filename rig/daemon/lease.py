"""Control: one client at a time has it, and a client that is gone does not."""

import threading
import time
from collections.abc import Callable

from rig.reasons import rig_error

LEASE_S = 2.0
"""Control lapses when its holder was not heard for so long."""


class Lease:
    """Who holds control. Safe to ask from any thread.

    Parameters
    ----------
    now
        Seconds, monotonic.

    Attributes
    ----------
    name
        What the holder calls itself.
    """

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now = now
        self._guard = threading.Lock()
        self._holder: object = None
        self.name = ""
        self._until = 0.0

    @property
    def holder(self) -> object:
        """The client in control; `None` for nobody, also when its lease has lapsed."""
        with self._guard:
            return self._holder if self._now() < self._until else None

    def take(self, client: object, name: str) -> None:
        """Give control to a client that may already have it.

        Raises
        ------
        ControlError
            Another client has it.
        """
        with self._guard:
            if self._holder not in {None, client} and self._now() < self._until:
                raise rig_error("control_held", holder=self.name)
            self._holder, self.name, self._until = client, name, self._now() + LEASE_S

    def heard(self, client: object) -> None:
        """Note a sign of life; control that lapsed and that nobody took comes back with it."""
        with self._guard:
            if self._holder is client:
                self._until = self._now() + LEASE_S

    def silence(self, client: object) -> float:
        """How long nothing has been heard from the client in control, s; 0 for any other."""
        with self._guard:
            return max(0.0, self._now() - self._until + LEASE_S) if self._holder is client else 0.0

    def release(self, client: object) -> bool:
        """Take control away from a client; `False` when it did not have it."""
        with self._guard:
            if self._holder is not client:
                return False
            self._holder, self.name, self._until = None, "", 0.0
            return True

    def require(self, client: object) -> None:
        """Let only the client in control go on, or the last one that had it, while nobody took it.

        Raises
        ------
        ControlError
            Another client has control, or this one gave it up.
        """
        # A request may wait behind a busy disk for longer than a lease: that takes nothing away.
        with self._guard:
            if self._holder is not client:
                raise rig_error("control_needed", holder=self.name or "nobody")
