# SPDX-License-Identifier: GPL-3.0-or-later
"""What a board needs of the controller on it, whoever emulates that."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple, Protocol

from rig.errors import DeviceError


class EmulatorError(DeviceError):
    """The firmware did what no firmware should: a bad instruction or address, an endless sleep."""


class Stop(IntEnum):
    """Why `Controller.run` came back."""

    REACHED = 0
    PIN = 1
    SENT = 2


class Change(NamedTuple):
    """An output pin (such as ``"PE4"``) driven high or no longer, by the instruction at `cycle`."""

    cycle: int
    pin: str
    high: bool


class Sent(NamedTuple):
    """A byte of the board's, complete at `cycle`."""

    cycle: int
    value: int


class Controller(Protocol):
    """Cycles, pins and bytes; each emulator says more of its own."""

    @property
    def cycle(self) -> int:
        """Cycles since power-up; they go on over resets."""
        ...

    @property
    def watchdog_resets(self) -> int:
        """How often the watchdog has bitten."""
        ...

    def run(self, until: int, *, stop_on_sent: bool = False) -> Stop:
        """Let it work up to a cycle, or to a change of a watched pin, or to a byte."""
        ...

    def reset(self) -> None:
        """Pull the reset pin; memory stays, and what comes on the wires."""
        ...

    def brown_out(self) -> None:
        """Let the supply sink so far that it restarts; memory stays as it was."""
        ...

    def edge(self, cycle: int, pin: str, level: bool) -> None:
        """Give a pin a level from outside, from `cycle` on (what is over means now)."""
        ...

    def clear_edges(self, pin: str) -> None:
        """Forget the edges that are still to come at a pin."""
        ...

    def watch(self, pin: str, on: bool = True) -> None:
        """Let `run` come back when this output changes."""
        ...

    def output(self, pin: str) -> bool:
        """Whether the pin is driven high now."""
        ...

    def take_changes(self) -> list[Change]:
        """Take what the output pins did since the last time."""
        ...

    def receive(self, data: bytes, cycle: int = 0) -> None:
        """Send it bytes, not before `cycle`."""
        ...

    def rate(self, baudrate: float) -> None:
        """Let the host at the other end of the line take another rate."""
        ...

    def take_sent(self) -> list[Sent]:
        """Take what it has sent since the last time."""
        ...
