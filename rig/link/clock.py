"""Time: the host's clock, which can be replaced, and the device's tick rate against it."""

from __future__ import annotations

import time
from dataclasses import dataclass
from math import sqrt
from statistics import median
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from rig.records import Ping

RESONATOR_TOLERANCE = 0.005
"""Genuine Uno and Mega boards clock the AVR from a ceramic resonator, ±0.5 % (Murata CSTCE16M0)."""
_SEARCH = 0.006  # the tolerance with some room for temperature and a cheap clone
_WRAP = 1 << 32
_OUTLIER = 6.0  # robust standard deviations; a sample late by more was not late by chance
_PRIOR = 2.0  # weight of the prior scatter, in samples, so that few samples stay honest


class Clock(Protocol):
    """Where time comes from; a simulated port brings its own."""

    def now_ns(self) -> int:
        """Monotonic host time."""
        ...

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        ...


class SystemClock:
    """The computer's monotonic clock."""

    def now_ns(self) -> int:
        """Monotonic host time."""
        return time.monotonic_ns()

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        time.sleep(seconds)


@dataclass(frozen=True, slots=True)
class TickRate:
    """How fast the device counts, in host seconds.

    Attributes
    ----------
    hz
        Ticks a host second.
    u_hz
        Its standard uncertainty (k = 1).
    n
        Samples used; 0 when the nominal rate had to do.
    span_s
        Time they cover, without the gaps across resets.
    """

    hz: float
    u_hz: float
    n: int
    span_s: float


@dataclass(slots=True)
class _Sample:
    """A ping as host seconds since the epoch began, ticks beyond nominal, and its scatter in s."""

    at: float
    excess: float
    sigma: float


def tick_rate(pings: Iterable[Ping], nominal_hz: int, boots_ns: Sequence[int] = ()) -> TickRate:
    """Measure the device's tick rate from clock samples.

    A straight line through (host time in the middle of the round trip, tick), one slope for all
    samples and one intercept for each epoch between resets. Each sample is weighted by what its
    own round trip allows: the tick was read at an unknown moment within it. Samples far off the
    line are left out. The uncertainty is the fit's, scaled by the scatter that was seen. Space
    pings unevenly: a period in step with a USB frame turns its delay into a false slope.

    Parameters
    ----------
    pings
        Clock samples in any order; gaps up to five hours are bridged, since within ±0.6 % the
        number of wraps of the 32-bit tick is then still certain.
    nominal_hz
        What the device says its rate is.
    boots_ns
        Host times at which the device restarted. Restarts not listed are found when the tick
        jumps out of tolerance.

    Returns
    -------
    TickRate
        The rate; the nominal one with u = 0.5 %/√3 when the samples say no more than that.
    """
    epochs = [_samples(epoch, nominal_hz) for epoch in _epochs(pings, nominal_hz, boots_ns)]
    kept = _without_outliers([epoch for epoch in epochs if len(epoch) >= 2], nominal_hz)
    n = sum(map(len, kept))
    nominal = TickRate(nominal_hz, nominal_hz * RESONATOR_TOLERANCE / sqrt(3), 0, 0.0)
    if n < 2:
        return nominal
    slope, sxx = _slope(kept)
    chi2 = sum((r / (s.sigma * nominal_hz)) ** 2 for s, r in _residuals(kept, slope))
    scale2 = (chi2 + _PRIOR) / (n - len(kept) - 1 + _PRIOR)
    span = sum(epoch[-1].at - epoch[0].at for epoch in kept)
    rate = TickRate(nominal_hz + slope, nominal_hz * sqrt(scale2 / sxx), n, span)
    return rate if rate.u_hz < nominal.u_hz else nominal


def _epochs(pings: Iterable[Ping], nominal_hz: int, boots_ns: Sequence[int]) -> list[list[Ping]]:
    """Split the samples where the device restarted, with ticks made wide by counting wraps."""
    epochs: list[list[Ping]] = []
    last: Ping | None = None
    for ping in sorted(pings):
        wide = None
        if last is not None and not any(
            last.host_recv_ns <= boot <= ping.host_recv_ns for boot in boots_ns
        ):
            wide = _widen(last, ping, nominal_hz)
        if wide is None:
            wide = ping.tick
            epochs.append([])
        last = ping._replace(tick=wide)
        epochs[-1].append(last)
    return epochs


def _widen(last: Ping, ping: Ping, nominal_hz: int) -> int | None:
    """Count the wraps between two samples; `None` when they cannot be of one count."""
    elapsed_ns = (ping.host_send_ns + ping.host_recv_ns - last.host_send_ns - last.host_recv_ns) / 2
    trips_ns = ping.host_recv_ns - ping.host_send_ns + last.host_recv_ns - last.host_send_ns
    expected = elapsed_ns * 1e-9 * nominal_hz
    slack = abs(expected) * _SEARCH + trips_ns * 1e-9 * nominal_hz / 2 + 2
    if slack >= _WRAP / 2:
        return None
    # Nearest to the expectation among the values that agree with the 32 bits seen.
    off = (ping.tick - last.tick - round(expected) + _WRAP // 2) % _WRAP - _WRAP // 2
    return last.tick + round(expected) + off if abs(off) <= slack else None


def _samples(epoch: list[Ping], nominal_hz: int) -> list[_Sample]:
    """Turn wide samples into numbers small enough for floats."""
    first = epoch[0]
    # The fastest trip is the line's own; what a trip takes beyond it is delay on one unknown
    # side, and displaces the middle by half. A quarter of the fastest trip stands for the rest.
    fastest_ns = min(ping.host_recv_ns - ping.host_send_ns for ping in epoch)
    samples = []
    for ping in epoch:
        trip_ns = ping.host_recv_ns - ping.host_send_ns
        middle_ns2 = ping.host_send_ns + ping.host_recv_ns - 2 * first.host_send_ns
        # In integers: a day's ticks times 1e9 do not fit a float's 53 bits.
        excess = ((ping.tick - first.tick) * 2_000_000_000 - nominal_hz * middle_ns2) / 2e9
        if len(epoch) > 2:
            spread_ns = (trip_ns - fastest_ns) / 2
            sigma_ns = sqrt(spread_ns**2 + (fastest_ns / 4) ** 2)
        else:
            sigma_ns = trip_ns / sqrt(12)  # nothing to compare with: anywhere in the trip
        sigma = sqrt(sigma_ns**2 * 1e-18 + 1 / (12 * nominal_hz**2))
        samples.append(_Sample(middle_ns2 * 0.5e-9, excess, sigma))
    return samples


def _slope(epochs: list[list[_Sample]]) -> tuple[float, float]:
    """Weighted common slope (ticks beyond nominal a second) and its Σ w (x − x̄)²."""
    sxx = sxy = 0.0
    for epoch in epochs:
        weights = [s.sigma**-2 for s in epoch]
        total = sum(weights)
        x0 = sum(w * s.at for w, s in zip(weights, epoch, strict=True)) / total
        y0 = sum(w * s.excess for w, s in zip(weights, epoch, strict=True)) / total
        for w, s in zip(weights, epoch, strict=True):
            sxx += w * (s.at - x0) ** 2
            sxy += w * (s.at - x0) * (s.excess - y0)
    return (sxy / sxx if sxx > 0 else 0.0), max(sxx, 1e-300)


def _residuals(epochs: list[list[_Sample]], slope: float) -> list[tuple[_Sample, float]]:
    """Each sample with its distance from the line, in ticks."""
    found = []
    for epoch in epochs:
        total = sum(s.sigma**-2 for s in epoch)
        mean = sum((s.excess - slope * s.at) * s.sigma**-2 for s in epoch) / total
        found += [(s, s.excess - slope * s.at - mean) for s in epoch]
    return found


def _without_outliers(epochs: list[list[_Sample]], nominal_hz: int) -> list[list[_Sample]]:
    """Leave out samples that are far off even for their own round trip, a few passes long."""
    for _ in range(5):
        if sum(map(len, epochs)) < 5:
            break
        slope, _sxx = _slope(epochs)
        pulls = [(s, abs(r) / (s.sigma * nominal_hz)) for s, r in _residuals(epochs, slope)]
        limit = _OUTLIER * max(1.4826 * median(pull for _, pull in pulls), 1e-3)
        bad = {id(s) for s, pull in pulls if pull > limit}
        if not bad:
            break
        kept = ([s for s in epoch if id(s) not in bad] for epoch in epochs)
        epochs = [epoch for epoch in kept if len(epoch) >= 2]
    return epochs
