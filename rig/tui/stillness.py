"""Whether the screen stood still for long enough that a key can be meant for what it shows."""

from __future__ import annotations

from collections.abc import Hashable
from time import monotonic

STILL_S = 0.5
"""Longer than between two letters of somebody who types, or two repeats of a key held down."""
_HELD_UP_S = 0.35
"""More than the program ever leaves between two signs of life by itself."""


class Stillness:
    """Remembers when the screen came to show what it shows, and when a hand last touched it.

    Times are those of the events themselves (`textual.message.Message.time`, monotonic, s): a key
    that waited while the program was busy was pressed before it is handled. When all of the program
    was held up nobody knows when a key was pressed: none is meant until it stood still anew.

    Parameters
    ----------
    needed_s
        How long is long enough.
    """

    def __init__(self, needed_s: float = STILL_S) -> None:
        self._needed_s = needed_s
        self._face: Hashable = None
        self._held_up_s = _HELD_UP_S if needed_s else float("inf")
        self._shown_s = self._touched_s = self._alive_s = float("-inf")

    def alive(self, now_s: float) -> None:
        """Take note of a sign of life of the program; due several times a second."""
        if now_s - self._alive_s > self._held_up_s:
            self.touched(now_s)
        self._alive_s = now_s

    def shown(self, face: Hashable) -> None:
        """Take note of what the screen shows now."""
        if face != self._face:
            self._face, self._shown_s = face, monotonic()

    def touched(self, at_s: float) -> None:
        """Take note of a key or a mouse button."""
        self._touched_s = max(self._touched_s, at_s)

    def read(self, face: Hashable, at_s: float) -> bool:
        """Whether `face` was there for long enough before a key of that moment."""
        return face == self._face and at_s - self._shown_s >= self._needed_s

    def meant(self, face: Hashable, at_s: float) -> bool:
        """Whether besides nothing was touched meanwhile: not typed, pasted, or held down."""
        still = at_s - self._touched_s >= self._needed_s
        return self.read(face, at_s) and still and at_s - self._alive_s <= self._held_up_s
