"""The device's tick rate, from pings by the host's clock and from pulses of a 1 Hz reference."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from rig.arrays import Array
from rig.clock.epochs import RESONATOR_TOLERANCE, Epochs
from rig.clock.samples import RECV, SEND, TICK, Samples
from rig.clock.wander import Readings, Track
from rig.records import Pulse

_OUTLIER = 6.0  # robust standard deviations; a sample late by more was not late by chance
_PASSES = 5
_MOSTLY = 0.9  # of the samples: leaving out more than the rest is no gate, it is another model
_EDGE_S = 1e-7  # scatter of a GPS receiver's pulses; the capture itself adds a tick's
_STALE_S = 1.2  # an older pulse is the last of a reference that was taken away
_COUNT_WRAP = 1 << 16
_ODD = 1e-3  # part of the ticks between two pulses that may be missing or too many
_ODD_S = 0.1


@dataclass(frozen=True, slots=True)
class TickRate:
    """How fast the device counts, by another clock.

    Attributes
    ----------
    hz
        Mean number of ticks a second of that clock, over all samples.
    u_hz
        Its standard uncertainty (k = 1); the other clock's own error is not in it.
    n
        Samples used; 0 when the nominal rate had to do.
    span_s
        Time they cover, without the gaps across resets.
    outliers
        Samples left out.
    nominal_hz
        What the device says its rate is.
    track
        The rate as a function of time.
    """

    hz: float
    u_hz: float
    n: int
    span_s: float
    outliers: int = 0
    nominal_hz: float = 0.0
    track: Track | None = field(default=None, compare=False, repr=False)

    def at(self, seconds: float) -> tuple[float, float]:
        """Return `hz` and `u_hz` at a moment, s on the axis of the samples' host times."""
        if self.track is None:
            return self.hz, self.u_hz
        return _least(self.nominal_hz, self.track.rate(seconds))


def ping_rate(split: Epochs) -> TickRate:
    """Measure the tick rate by the host's clock.

    A line through (host time in the middle of the round trip, tick): one slope for all samples,
    which may wander slowly, and one intercept for each epoch. Each sample is weighted by what its
    own round trip allows: the tick was read at an unknown moment within it. Samples far off the
    line are left out. The uncertainty is scaled by the scatter that was seen. Space pings
    unevenly: a period in step with a USB frame turns its delay into a false slope.

    Parameters
    ----------
    split
        Clock samples by epoch.

    Returns
    -------
    TickRate
        The rate; the nominal one with u = 0.5 %/√3 when the samples say no more than that.
    """
    pieces = [_ping_piece(pings, split.nominal_hz) for pings in split.pings if len(pings) > 1]
    rate = _fit_track(pieces, split.nominal_hz)
    return replace(rate, outliers=sum(map(len, split.pings)) - rate.n)


def pulse_rate(split: Epochs, pulses: Iterable[Pulse], pings: TickRate) -> TickRate:
    """Measure the tick rate by the seconds of a reference.

    Parameters
    ----------
    split
        Clock samples by epoch: they say which second of the host a pulse belongs to.
    pulses
        What the device said of its reference, in any order.
    pings
        The rate by the host's clock.

    Returns
    -------
    TickRate
        The rate; the nominal one when there are not two pulses of one stretch. A pulse that was
        missed or one too many begins a new stretch.
    """
    placed: list[tuple[int, int, int, int]] = []
    for pulse in sorted(pulses):
        host_ns = (pulse.host_send_ns + pulse.host_recv_ns) // 2
        moment = split.place(pulse.tick, host_ns, pings.hz, _STALE_S, 0.0)
        if moment is not None:
            placed.append((*moment, pulse.number))
    rows = np.array(placed, np.int64).reshape(-1, 4)
    # A pulse that was reported twice counts once.
    rows = rows[np.diff(rows[:, :2], axis=0, prepend=-1).any(axis=1)]
    restarts, ticks, _, counts = np.diff(rows, axis=0).T
    seconds, counted = ticks / pings.hz, counts % _COUNT_WRAP
    counted += np.rint((seconds - counted) / _COUNT_WRAP).astype(np.int64) * _COUNT_WRAP
    broken = (restarts != 0) | (np.abs(seconds - counted) >= _ODD_S + _ODD * counted)
    rows[:, -1] = np.append(0, np.cumsum(counted))  # seconds, where the device's count wraps
    stretches = np.split(rows, np.flatnonzero(broken) + 1)
    pieces = [_pulse_piece(each, split.nominal_hz) for each in stretches if len(each) > 1]
    return _fit_track(pieces, split.nominal_hz)


def _ping_piece(pings: Samples, nominal_hz: int) -> Array:
    """Turn samples of one epoch into readings small enough for floats, as `_fit_track` wants."""
    begin_ns = int(pings[0, SEND])
    trip_ns = pings[:, RECV] - pings[:, SEND]
    # The fastest trip is the line's own; what a trip takes beyond it is delay on one unknown
    # side, and displaces the middle by half. A quarter of the fastest trip stands for the rest.
    fastest_ns = float(trip_ns.min())
    sigma_ns: Array = np.sqrt(((trip_ns - fastest_ns) / 2) ** 2 + (fastest_ns / 4) ** 2)
    if len(pings) == 2:
        sigma_ns = trip_ns / sqrt(12)  # nothing to compare with: anywhere in the trip
    middle_ns2 = pings[:, SEND] + pings[:, RECV] - 2 * begin_ns
    # Whole seconds in integers: a day's ticks and nanoseconds leave a float too few bits.
    seconds, rest_ns2 = np.divmod(middle_ns2, 2_000_000_000)
    excess = pings[:, TICK] - pings[0, TICK] - nominal_hz * seconds
    at = begin_ns * 1e-9 + middle_ns2 / 2e9
    sigma: Array = np.sqrt(sigma_ns**2 * 1e-18 + 1 / (12 * nominal_hz**2))
    return np.array([at, excess / nominal_hz - rest_ns2 * 0.5e-9, sigma])


def _pulse_piece(stretch: NDArray[np.int64], nominal_hz: int) -> Array:
    """Turn pulses of one stretch, each an epoch, tick, host time and count, into readings."""
    sigma = sqrt(_EDGE_S**2 + 1 / (12 * nominal_hz**2))
    _, ticks, _, seconds = (stretch - stretch[0]).T
    excess = (ticks - nominal_hz * seconds) / nominal_hz
    at = int(stretch[0, 2]) * 1e-9 + seconds
    return np.array([at, excess, np.full(len(stretch), sigma)])


def _fit_track(pieces: Sequence[Array], nominal_hz: int) -> TickRate:
    """Fit a track, leave out what is far off even for its own scatter, and fit again.

    Parameters
    ----------
    pieces
        Readings of one intercept each, shape (3, n): when, s; s beyond nominal; their scatter, s.
    nominal_hz
        What the device says its rate is.
    """
    epoch = np.repeat(np.arange(len(pieces)), [piece.shape[1] for piece in pieces])
    at, phase, sigma = np.concatenate([np.empty((3, 0)), *pieces], axis=1)
    everything = Readings(at, phase, sigma, epoch)
    # A walk can follow stray samples, and a steady rate takes a walk's ends for stray: what
    # little strays from a steady rate is left out first, and the rest asked whether it wanders.
    readings, track = _reject_outliers(everything, steady=True)
    if track is not None:
        track.search()
        if track.seen or readings.at.size < _MOSTLY * everything.at.size:
            readings, track = _reject_outliers(everything, steady=False)
    nominal, rate = _least(nominal_hz), _least(nominal_hz, track.mean() if track else None)
    if track is None or rate == nominal:
        return TickRate(*nominal, 0, 0.0, nominal_hz=nominal_hz)
    ends = np.flatnonzero(np.diff(readings.epoch, append=-1))
    starts = np.flatnonzero(np.diff(readings.epoch, prepend=-1))
    span = float((readings.at[ends] - readings.at[starts]).sum())
    n = readings.at.size
    return TickRate(*rate, n, span, everything.at.size - n, nominal_hz, track)


def _reject_outliers(readings: Readings, *, steady: bool) -> tuple[Readings, Track | None]:
    """Leave out what is far off, a few passes long; no track where too little is left."""
    for number in range(_PASSES):
        if readings.at.size < 2 or readings.at[-1] <= readings.at[0]:
            return readings, None
        track = Track(readings)
        if not steady:
            track.search()
        pulls = np.abs(track.residuals(readings))
        far = pulls > _OUTLIER * max(1.4826 * float(np.median(pulls)), 1e-3)
        if readings.at.size < 5 or not far.any() or number == _PASSES - 1:
            break
        readings = readings.only(~far)
    return readings, track


def _least(nominal_hz: float, relative: tuple[float, float] | None = None) -> tuple[float, float]:
    """Turn a relative rate and its uncertainty to Hz; the nominal ones where they say no more."""
    u = RESONATOR_TOLERANCE / sqrt(3)
    if relative is None or relative[1] >= u:
        return nominal_hz, nominal_hz * u
    return nominal_hz * (1.0 + relative[0]), nominal_hz * relative[1]
