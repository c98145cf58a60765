"""The host's clock, which can be replaced, and whether the host's clocks go on as one."""

import time
from collections.abc import Callable
from typing import NamedTuple, Protocol

from rig.records import HostBreak

TOLERANCE_NS = 50_000_000
"""Differences below this are the reading's own: a process can be held up between two clocks."""
_TRIES = 5
_BOOTTIME: int | None = getattr(time, "CLOCK_BOOTTIME", None)


class Clock(Protocol):
    """Where time comes from; a simulated port brings its own."""

    def now_ns(self) -> int:
        """Monotonic host time."""

    def sleep(self, seconds: float) -> None:
        """Let time pass."""


class SystemClock:
    """The computer's monotonic clock."""

    now_ns = staticmethod(time.monotonic_ns)
    sleep = staticmethod(time.sleep)


class HostClocks(NamedTuple):
    """The host's clocks at one moment, ns.

    Attributes
    ----------
    monotonic
        The clock of all samples; on Linux it stands still while the host sleeps.
    boottime
        The same, going on through sleep; where the system has none, about `monotonic` again.
    wall
        Time of day, which may be set.
    """

    monotonic: int
    boottime: int
    wall: int


def read_clocks() -> HostClocks:
    """Read them as close together as the system allows: several times, and take the quickest."""
    readings: list[tuple[int, HostClocks]] = []
    for _ in range(_TRIES):
        before = time.monotonic_ns()
        boottime = before if _BOOTTIME is None else time.clock_gettime_ns(_BOOTTIME)
        wall = time.time_ns()
        took = time.monotonic_ns() - before
        readings.append((took, HostClocks(before + took // 2, boottime, wall)))
    return min(readings)[1]


class HostWatch:
    """Compares the clocks from look to look.

    The monotonic clock is steered (slewed) together with the others, so only sleep moves it
    against the boot-time clock, and only somebody's hand the wall clock against that. Without a
    boot-time clock the two cannot be told apart, and whatever moves the wall clock counts as a
    step: either way no line goes through samples from both sides.

    Parameters
    ----------
    read
        Where the clocks are read.
    """

    def __init__(self, read: Callable[[], HostClocks] = read_clocks) -> None:
        self._read = read
        self._last = read()

    def look(self) -> HostBreak | None:
        """Return what happened since the last look, `None` when nothing did."""
        last, clocks = self._last, self._read()
        passed_ns = clocks.boottime - last.boottime
        awake_ns = clocks.monotonic - last.monotonic
        moved = passed_ns - awake_ns, clocks.wall - last.wall - passed_ns
        slept_ns, stepped_ns = (ns if abs(ns) >= TOLERANCE_NS else 0 for ns in moved)
        if not slept_ns and not stepped_ns:
            return None  # what is too small to tell stays in the comparison, and may add up
        self._last = clocks
        return HostBreak(clocks.monotonic, slept_ns, stepped_ns)
