"""Ticks of 32 bits made wide, in epochs between restarts of the board."""

from bisect import bisect_right
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rig.clock.samples import RECV, SEND, TICK, Samples

RESONATOR_TOLERANCE = 0.005
"""Genuine Uno and Mega boards clock the AVR from a ceramic resonator, ±0.5 % (Murata CSTCE16M0)."""
_SEARCH = 0.006  # the tolerance with some room for temperature and a cheap clone
_WANDER = 1e-3  # what a rate that is known may change by until it is used
WRAP = 1 << 32
_BROKEN = -(1 << 62)


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


class Epochs(NamedTuple):
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
    pings: tuple[Samples, ...]

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
        number = bisect_right([int(pings[0, SEND]) for pings in self.pings], host_ns) - 1
        if number < 0:
            return None
        pings = self.pings[number]
        latest = int(np.searchsorted(pings[:, SEND], host_ns, "right")) - 1
        send_ns, recv_ns, near = pings[latest].tolist()
        gap_s = (host_ns - (send_ns + recv_ns) // 2) * 1e-9
        expected = near + round(gap_s * hz)
        off = (tick - expected + WRAP // 2) % WRAP - WRAP // 2
        slack_s = (recv_ns - send_ns) * 1e-9 + abs(gap_s) * _WANDER
        if not -early_s - slack_s <= off / hz <= late_s + slack_s:
            return None
        return Moment(number, expected + off, host_ns + round(off / hz * 1e9))


def epochs(pings: Samples, nominal_hz: int, cuts_ns: Sequence[int] = ()) -> Epochs:
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
    if not pings.size:
        return Epochs(nominal_hz, ())
    columns = pings[np.lexsort(pings.T[::-1])]  # as tuples are sorted
    cuts = np.sort(np.array(cuts_ns, np.int64))
    steps = _steps(columns, nominal_hz)
    first_cut = np.searchsorted(cuts, columns[:-1, RECV], "left")
    steps[first_cut < np.searchsorted(cuts, columns[1:, SEND], "right")] = _BROKEN
    begins = np.flatnonzero(steps == _BROKEN) + 1
    pieces = np.split(columns, begins)
    for piece, counted in zip(pieces, np.split(np.append(0, steps), begins), strict=True):
        counted[0] = piece[0, TICK]
        piece[:, TICK] = np.cumsum(counted)
    return Epochs(nominal_hz, tuple(pieces))


def _steps(columns: Samples, nominal_hz: int) -> NDArray[np.int64]:
    """Count ticks from each sample to the next; `_BROKEN` when they cannot be of one count."""
    trips_ns = columns[:, RECV] - columns[:, SEND]
    expected = np.diff((columns[:, SEND] + columns[:, RECV]) // 2) * 1e-9 * nominal_hz
    slack = np.abs(expected) * _SEARCH + (trips_ns[1:] + trips_ns[:-1]) * 1e-9 * nominal_hz / 2 + 2
    rounded = np.rint(expected).astype(np.int64)
    # Nearest to the expectation among the values that agree with the 32 bits seen.
    off = (np.diff(columns[:, TICK]) - rounded + WRAP // 2) % WRAP - WRAP // 2
    return np.where((slack < WRAP / 2) & (np.abs(off) <= slack), rounded + off, _BROKEN)
