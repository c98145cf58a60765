"""The time scale of a session: from its clock samples to seconds, and how far to trust them."""

from collections.abc import Mapping, Sequence
from math import floor, hypot, log2, sqrt
from typing import Any, NamedTuple, Protocol

import numpy as np

from rig.clock.epochs import RESONATOR_TOLERANCE, Epochs, epochs
from rig.clock.rate import TickRate, ping_rate, pulse_rate
from rig.clock.samples import HostTime, Samples, one_axis, samples
from rig.reasons import make_reason
from rig.records import ClockSample, Drop, HostBreak, Pulse
from rig.threads import one_thread
from rig.units import significant

HOST_U = 50e-6 / sqrt(3)
"""Of a computer's clock, relative: ±50 ppm for its quartz with temperature and age; a steered one
(NTP) is better, but nothing here knows. Virtual time is exact."""
_UNKNOWN = RESONATOR_TOLERANCE / sqrt(3)
_ROUGH = 1e-4
"""Of a time scale, relative: 0.1 mm in a metre, far less than from rod to rod."""
_WORDS = {
    "stated": "nominal tick rate: too few clock samples",
    "pings": "device against host clock, {} samples",
    "reference": "device against 1 Hz reference, {} pulses",
}
_FIRED_S = 1.0  # FIRED is logged before the request leaves; the device waits 0.25 s at most


class TimeScale(NamedTuple):
    """Seconds from ticks: the rate in Hz and its relative standard uncertainty."""

    hz: float
    u: float

    def coarse(self) -> "TimeScale":
        """Return a scale near by, good enough to tell rods apart: further samples leave it."""
        step = 2.0 ** floor(log2(_ROUGH * self.hz))
        return TimeScale(step * round(self.hz / step), max(self.u, _ROUGH))


class ClockLog(Protocol):
    """What a session has of clocks; `rig.session.reading.Reader` says what each of these is."""

    @property
    def simulated(self) -> bool:
        """Whether the host's clock is exact."""

    def identities(self) -> Sequence[tuple[int, Mapping[str, Any]]]:
        """Host time and content of every identity."""

    def pings(self, after: int = 0) -> Sequence[ClockSample]:
        """Clock samples, all but the first so many."""

    def pulses(self) -> Sequence[Pulse]:
        """Pulses of the 1 Hz reference."""

    def host_breaks(self) -> Sequence[HostBreak]:
        """When the host slept or its clock was set."""

    def fired_ns(self) -> Mapping[tuple[int, int], int]:
        """When each run and attempt was fired."""


class Source(NamedTuple):
    """One clock that the board was compared with.

    Attributes
    ----------
    name
        ``pings`` (the host's clock), ``reference``, or ``stated`` for the nominal rate.
    rate
        The board's rate by that clock.
    u
        Relative standard uncertainty of that clock itself.
    """

    name: str
    rate: TickRate
    u: float

    def mean(self) -> TimeScale:
        """Time scale over all its samples."""
        return TimeScale(self.rate.hz, hypot(self.rate.u_hz / self.rate.hz, self.u))

    def at(self, seconds: float | None) -> TimeScale:
        """Time scale at a moment of the host's time.

        Parameters
        ----------
        seconds
            s; for `None`, a moment nobody knows, it is the mean, and how far the rate may be from
            it.
        """
        if seconds is not None:
            hz, u_hz = self.rate.at(seconds)
            return TimeScale(hz, hypot(u_hz / hz, self.u))
        (hz, u), track = self.mean(), self.rate.track
        return TimeScale(hz, hypot(u, track.wander * sqrt(track.span)) if track else u)


class FireTimes(NamedTuple):
    """When drops were fired.

    Attributes
    ----------
    samples
        Clock samples by epoch.
    time
        The axis of host time they are on.
    fired_ns
        About when each run and attempt was fired, by the host's clock as it was then.
    """

    samples: Epochs
    time: HostTime
    fired_ns: Mapping[tuple[int, int], int]

    def when(self, drop: Drop, hz: float) -> float | None:
        """Find when a drop was fired, s of host time, by its tick among the samples around it.

        Parameters
        ----------
        hz
            The board's mean rate.
        """
        fired_ns, tick = self.fired_ns.get(drop.job), drop.fire_tick
        if fired_ns is None or tick is None:
            return None
        # Restarts of the host leave open which of its times a log entry means; the tick decides.
        times_ns = [fired_ns + shift for shift in self.time.shifts(fired_ns)]
        moments = (self.samples.place(tick, time_ns, hz, 0.0, _FIRED_S) for time_ns in times_ns)
        return next((moment.at_ns * 1e-9 for moment in moments if moment is not None), None)


class Calibration(NamedTuple):
    """The time scale of a session.

    Attributes
    ----------
    device
        Mean of drops from the device; `None` where there was none.
    details
        For reports: numbers by name.
    said
        What ``rig analyze --json`` prints as ``calibration``.
    timer_u
        Relative standard uncertainty of the time scale of imported edges.
    sources
        Clocks the board was compared with, the best one first; without any its nominal rate.
    fired
        When drops were fired.
    """

    device: TimeScale | None
    details: dict[str, Any]
    said: dict[str, Any]
    timer_u: float = _UNKNOWN
    sources: tuple[Source, ...] = ()
    fired: FireTimes | None = None

    def scale(self, drop: Drop) -> TimeScale:
        """Time scale of one drop; edges from another timer keep that timer's."""
        return self._scale_of(drop)[1]

    def describe(self, drop: Drop) -> dict[str, Any]:
        """Say which calibration a drop has: where from, ppm off nominal, and how well known."""
        name, (hz, u) = self._scale_of(drop)
        return {"source": name, "rate_ppm": (hz / drop.tick_hz - 1.0) * 1e6, "u_ppm": u * 1e6}

    def _scale_of(self, drop: Drop) -> tuple[str, TimeScale]:
        if drop.certificate is None or self.device is None:
            return "stated", TimeScale(drop.tick_hz, self.timer_u)
        when = self.fired.when(drop, self.device.hz) if self.fired else None
        scales = [(source.name, source.at(when)) for source in self.sources]
        return min(scales, key=lambda named: named[1].u)


class Calibrator:
    """Calibrates one session again and again while it grows, and reads only what is new of it."""

    def __init__(self) -> None:
        self._pings = samples(())

    @one_thread
    def look(self, session: ClockLog, reference_u: float) -> Calibration:
        """Calibrate the session's clock from everything it recorded until now.

        Parameters
        ----------
        session
            Always the same one, however it was opened.
        reference_u
            Relative standard uncertainty of the 1 Hz reference, as the protocol has it.
        """
        latest = samples(session.pings(after=len(self._pings)))
        self._pings = np.concatenate([self._pings, latest])
        return _calibration(session, self._pings, reference_u)


def _calibration(session: ClockLog, pings: Samples, reference_u: float) -> Calibration:
    identities = session.identities()
    nominal = next((board["tick_hz"] for _, board in identities if "tick_hz" in board), None)
    u = next((board["clock_u"] for _, board in identities if "clock_u" in board), _UNKNOWN)
    said: dict[str, Any] = {"source": "stated", "rate_ppm": 0.0, "u_ppm": u * 1e6}
    if nominal is None:
        details = {"source": "times as the file gives them", "relative_u": u}
        return Calibration(None, details, said | {"notes": []}, u)
    breaks = session.host_breaks()
    axis = one_axis(pings, [ns for ns, _ in identities], breaks)
    split = epochs(axis.pings, nominal, axis.cuts_ns)
    by_host = Source("pings", ping_rate(split), 0.0 if session.simulated else HOST_U)
    shifted = [
        Pulse(send_ns + shift, recv_ns + shift, number, tick)
        for send_ns, recv_ns, number, tick in session.pulses()
        for shift in axis.shifts(send_ns)
    ]
    reference = Source("reference", pulse_rate(split, shifted, by_host.rate), reference_u)
    sources = [source for source in (by_host, reference) if source.rate.n]
    sources = sources or [by_host._replace(name="stated", u=0.0)]
    sources.sort(key=lambda source: source.mean().u)
    best, scale = sources[0], sources[0].mean()
    said |= {"source": best.name, "rate_ppm": (scale.hz / nominal - 1.0) * 1e6}
    said |= {"u_ppm": scale.u * 1e6, "nominal_tick_hz": nominal}
    if best.rate.n:
        said |= {"clock_u_ppm": best.u * 1e6, "span_s": best.rate.span_s}
    if best.rate.track is not None:
        said["wander_ppm_sqrt_h"] = best.rate.track.wander * 60.0 * 1e6
    if by_host.rate.n:
        said |= {"pings": by_host.rate.n, "outliers": by_host.rate.outliers}
    if reference.rate.n:
        said["pulses"] = reference.rate.n
    said |= {"epochs": len(split.pings), "host_breaks": len(breaks)}
    said["notes"] = _notes(sources, len(breaks))
    details = {"source": _WORDS[best.name].format(best.rate.n), "tick_hz": scale.hz}
    details |= {"nominal_tick_hz": nominal, "error_ppm": said["rate_ppm"], "u_ppm": said["u_ppm"]}
    details |= {"samples": best.rate.n, "span_s": best.rate.span_s}
    fired = FireTimes(split, axis, session.fired_ns())
    return Calibration(scale, details, said, u, tuple(sources), fired)


def _notes(sources: list[Source], breaks: int) -> list[str]:
    """Say what a reader should know before trusting the time scale."""
    notes = []
    if sources[0].name == "stated":
        notes.append(make_reason("clock_nominal"))
    if breaks:
        times = "once" if breaks == 1 else f"{breaks} times"
        notes.append(make_reason("host_clock_broken", times=times))
    if (track := sources[0].rate.track) is not None and track.seen:
        notes.append(make_reason("clock_wanders", wander_ppm=significant(track.wander * 60e6)))
    if len(sources) > 1:
        first, second = (source.mean() for source in sources)
        apart = first.hz / second.hz - 1.0
        if abs(apart) > 2.0 * hypot(first.u, second.u):
            notes.append(make_reason("reference_apart", apart_ppm=abs(apart) * 1e6))
    return [note.text for note in notes]
