"""Check that the screen was still long enough for a key to be meant for its content."""

from collections.abc import Hashable
from time import monotonic

STILL_S = 0.5
"""Longer than the interval between typed letters, or between repeats of a held key, s."""
_HELD_UP_S = 0.35
"""Longer than any interval between heartbeats of the running program, s."""


class Stillness:
    """Times of the latest change of the screen, and of the latest key or mouse button.

    Times are those of events (`textual.message.Message.time`, monotonic, s), as keys may be handled
    later than pressed. If the whole program was held up, the time of a key is unknown: then no key
    counts until the screen was still again.

    Parameters
    ----------
    needed_s
        Least time that the screen must be still, s.
    """

    def __init__(self, needed_s: float = STILL_S) -> None:
        self._needed_s = needed_s
        self._face: Hashable = None
        self._held_up_s = _HELD_UP_S if needed_s else float("inf")
        self._shown_s = self._touched_s = self._alive_s = float("-inf")

    def alive(self, now_s: float) -> None:
        """Note a heartbeat of the program, due several times a second."""
        if now_s - self._alive_s > self._held_up_s:
            self.note_input(now_s)
        self._alive_s = now_s

    def shown(self, face: Hashable) -> None:
        """Note the present content of the screen."""
        if face != self._face:
            self._face, self._shown_s = face, monotonic()

    def note_input(self, at_s: float) -> None:
        """Note a key or mouse button."""
        self._touched_s = max(self._touched_s, at_s)

    def read(self, face: Hashable, at_s: float) -> bool:
        """Whether `face` was shown long enough before a key at that time."""
        return face == self._face and at_s - self._shown_s >= self._needed_s

    def meant(self, face: Hashable, at_s: float) -> bool:
        """Whether in addition no other key was pressed meanwhile: typed, pasted or held down."""
        still = at_s - self._touched_s >= self._needed_s
        return self.read(face, at_s) and still and at_s - self._alive_s <= self._held_up_s
