"""A pseudo-terminal with a board at its far end, as a USB cable is."""

from __future__ import annotations

import contextlib
import os
import pty
import select
import termios
import tty
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

_CHUNK = 4096
_RATE = 5  # where `termios.tcgetattr` has the output's


class Terminal:
    """The line to a board, which programs open by its path, as often as they like.

    Parameters
    ----------
    link
        Symbolic link to the terminal, so that it is found again after `plug`; `None`: its path is
        what the kernel calls it.
    held
        Whether the line is alive between two clients too: what the board says then waits for the
        next one. Else it is lost, and it shows when somebody opens the terminal.

    Attributes
    ----------
    is_open
        Whether somebody has it open, as far as `look` saw; one that is held always is.
    """

    def __init__(self, link: Path | None = None, *, held: bool = True) -> None:
        self.link = link
        self._held = held
        self.is_open = False
        self._far: int | None = None
        self._near: int | None = None
        self._name = ""
        self.plug()

    @property
    def path(self) -> str:
        """Where other programs find it; empty while it is pulled."""
        return "" if self._far is None else str(self.link or self._name)

    @property
    def is_in(self) -> bool:
        """Whether the cable is in."""
        return self._far is not None

    def plug(self) -> None:
        """Put the cable in."""
        far, near = pty.openpty()
        tty.setraw(near)
        os.set_blocking(far, False)
        if self.link is not None:
            # Replaced, not removed and made: nobody finds it missing in between.
            beside = self.link.with_suffix(".new")
            beside.unlink(missing_ok=True)
            beside.symlink_to(os.ttyname(near))
            beside.replace(self.link)
        self._far, self._name, self.is_open = far, os.ttyname(near), self._held
        if self._held:
            self._near = near
        else:
            os.close(near)

    def pull(self) -> None:
        """Take the cable out: whoever has the terminal open has lost it."""
        if self._far is None:
            return
        if self.link is not None:
            self.link.unlink(missing_ok=True)
        for end in (self._far, self._near):
            if end is not None:
                os.close(end)
        self._far = self._near = None
        self.is_open = False

    def wait(self, seconds: float, *descriptors: int) -> list[int]:
        """Wait for bytes.

        Parameters
        ----------
        seconds
            At most so long.
        descriptors
            What else may end the waiting, as file descriptors.

        Returns
        -------
        list of int
            Those of `descriptors` that have something.
        """
        # A line that nobody has open hangs up all the time, and would end each waiting at once.
        watched = [*descriptors, *([self._far] if self._far is not None and self.is_open else [])]
        readable, _, _ = select.select(watched, [], [], seconds)
        return [descriptor for descriptor in descriptors if descriptor in readable]

    def look(self) -> bool:
        """See whether somebody has opened it since the last look."""
        if self._far is None:
            return False
        poll = select.poll()
        poll.register(self._far, select.POLLIN)
        state = sum(event for _, event in poll.poll(0))
        before, self.is_open = self.is_open, not state & select.POLLHUP
        return self.is_open and not before

    @property
    def rate(self) -> int:
        """The rate that was set last, as `termios` calls it."""
        assert self._far is not None
        return int(termios.tcgetattr(self._far)[_RATE])

    def read(self) -> bytes:
        """Take what was written to it."""
        if self._far is not None:
            with contextlib.suppress(OSError):  # nothing there, or nobody
                return os.read(self._far, _CHUNK)
        return b""

    def write(self, data: bytes) -> None:
        """Pass bytes on; what nobody takes is lost: a UART would not wait either."""
        if self._far is None or not self.is_open:
            return
        with contextlib.suppress(OSError):
            while data:
                data = data[os.write(self._far, data) :]
