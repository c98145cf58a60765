"""Ticks of 32 bits made wide, in epochs between restarts of the board."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from rig.records import Ping

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

RESONATOR_TOLERANCE = 0.005
"""Genuine Uno and Mega boards clock the AVR from a ceramic resonator, ±0.5 % (Murata CSTCE16M0)."""
_SEARCH = 0.006  # the tolerance with some room for temperature and a cheap clone
_WANDER = 1e-3  # what a rate that is known may change by until it is used
WRAP = 1 << 32


class Moment(NamedTuple):
    """Where a tick belongs.

    Attributes
    ----------
    epoch
        Number of the epoch.
    tick
        The tick, wide.
    at_ns
        Host time of it.
    """

    epoch: int
    tick: int
    at_ns: int


@dataclass(frozen=True, slots=True)
class Epochs:
    """Clock samples in the stretches over which the board's counter went on.

    Attributes
    ----------
    nominal_hz
        What the device says its rate is.
    pings
        Of each epoch, in order of time, with wide ticks: they count up from the epoch's first,
        through every wrap.
    """

    nominal_hz: int
    pings: tuple[tuple[Ping, ...], ...]

    def place(
        self, tick: int, host_ns: int, hz: float, early_s: float, late_s: float
    ) -> Moment | None:
        """Find the wide tick behind a u32 tick whose host time is about known.

        Parameters
        ----------
        tick
            As read from the board.
        host_ns
            About when it was.
        hz
            The measured rate.
        early_s, late_s
            How much before and after `host_ns` the tick can have been.

        Returns
        -------
        Moment or None
            `None` when no epoch's counter can have stood there then: the samples before it are of
            another epoch.
        """
        starts = [pings[0].host_send_ns for pings in self.pings]
        number = bisect_right(starts, host_ns) - 1
        if number < 0:
            return None
        pings = self.pings[number]
        near = pings[bisect_right(pings, host_ns, key=lambda ping: ping.host_send_ns) - 1]
        gap_s = (host_ns - _middle_ns(near)) * 1e-9
        expected = near.tick + round(gap_s * hz)
        off = _nearest(tick - expected)
        slack_s = (near.host_recv_ns - near.host_send_ns) * 1e-9 + abs(gap_s) * _WANDER
        if not -early_s - slack_s <= off / hz <= late_s + slack_s:
            return None
        return Moment(number, expected + off, host_ns + round(off / hz * 1e9))


def epochs(pings: Iterable[Ping], nominal_hz: int, cuts_ns: Sequence[int] = ()) -> Epochs:
    """Split samples where the board's counter did not go on, and count its wraps in between.

    Parameters
    ----------
    pings
        Clock samples in any order; gaps up to five hours are bridged, since within ±0.6 % the
        number of wraps of the 32-bit tick is then still certain.
    nominal_hz
        What the device says its rate is.
    cuts_ns
        Host times over which nothing is bridged. A counter that began anew, or a host clock that
        stood still, is found without them too, when the tick jumps out of tolerance.
    """
    cuts = sorted(cuts_ns)
    found: list[list[Ping]] = []
    last: Ping | None = None
    for ping in sorted(pings):
        wide = None
        if last is not None:
            cut = bisect_left(cuts, last.host_recv_ns)
            if cut == len(cuts) or cuts[cut] > ping.host_send_ns:
                wide = _widen(last, ping, nominal_hz)
        if wide is None:
            wide = ping.tick
            found.append([])
        last = Ping(ping.host_send_ns, ping.host_recv_ns, wide)
        found[-1].append(last)
    return Epochs(nominal_hz, tuple(map(tuple, found)))


def _widen(last: Ping, ping: Ping, nominal_hz: int) -> int | None:
    """Count the wraps between two samples; `None` when they cannot be of one count."""
    elapsed_ns = _middle_ns(ping) - _middle_ns(last)
    trips_ns = ping.host_recv_ns - ping.host_send_ns + last.host_recv_ns - last.host_send_ns
    expected = elapsed_ns * 1e-9 * nominal_hz
    slack = abs(expected) * _SEARCH + trips_ns * 1e-9 * nominal_hz / 2 + 2
    if slack >= WRAP / 2:
        return None
    # Nearest to the expectation among the values that agree with the 32 bits seen.
    off = _nearest(ping.tick - last.tick - round(expected))
    return last.tick + round(expected) + off if abs(off) <= slack else None


def _middle_ns(ping: Ping) -> int:
    return (ping.host_send_ns + ping.host_recv_ns) // 2


def _nearest(difference: int) -> int:
    """Fold a difference of ticks to the one nearest zero."""
    return (difference + WRAP // 2) % WRAP - WRAP // 2
