"""What stands before and behind a board in virtual time: the lab, and a simulated port."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Sequence


class Line(Protocol):
    """A board's bytes on their way to the host."""

    @property
    def byte_ns(self) -> int:
        """How long a byte takes, either way."""

    def next_arrival_ns(self) -> int | None:
        """Say when the host gets the next byte, as far as is known."""

    def read(self, now_ns: int) -> bytes:
        """Take what has reached the host by now."""


class Board(Protocol):
    """A board in virtual time."""

    @property
    def line(self) -> Line:
        """What it sends."""

    def receive(self, start_ns: int, data: bytes) -> None:
        """Take bytes from the host; the first begins to arrive at `start_ns`."""

    def reset(self, at_ns: int) -> None:
        """Restart, as opening the port does to a Mega."""

    def advance(self, until_ns: int) -> None:
        """Let happen what happens until a moment."""

    def next_ns(self) -> int | None:
        """Say when something will happen next, or `None` when nothing will."""


class Lab(Protocol):
    """The chains and beams in front of the gates."""

    def rest(self, label: int) -> int:
        """Say which beams are blocked while the chains hang.

        Parameters
        ----------
        label
            Of the drop that is being prepared.

        Returns
        -------
        int
            Gate mask, 1 = blocked.
        """

    def drop(self, label: int) -> Sequence[tuple[float, int, bool]]:
        """Let go.

        Parameters
        ----------
        label
            Of the drop.

        Returns
        -------
        sequence of (seconds after the release fired, channel, blocked)
            Every change of every beam, in order of time.
        """
