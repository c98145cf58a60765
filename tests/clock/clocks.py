"""A board's clock and a line of known truth, for the tests of calibration."""

import math
import random
from collections.abc import Callable

import numpy as np

from rig.clock.epochs import epochs
from rig.clock.rate import TickRate, ping_rate
from rig.clock.samples import samples
from rig.records import ClockSample, Pulse

HZ = 16_000_000
TRIP_S = 0.4e-3
Delay = Callable[[random.Random], float]


def tick_rate(pings, nominal_hz, cuts_ns=()) -> TickRate:
    """Return the rate from clock samples in any order."""
    return ping_rate(epochs(samples(pings), nominal_hz, cuts_ns))


DELAYS: dict[str, Delay] = {
    "exponential": lambda rng: rng.expovariate(1e3),
    # Pareto with an infinite variance: now and then a hundred times the mean.
    "heavy": lambda rng: 0.5e-3 * (rng.paretovariate(1.5) - 1.0),
    "stalls": lambda rng: rng.expovariate(1e3) + 0.05 * (rng.random() < 0.05),
}


class Clock:
    """A rate that drifts and wanders, ppm; the walk is after an hour."""

    def __init__(
        self, seed: int, *, ppm: float = -1300.0, drift: float = 0.0, walk: float = 0.0, last=7200
    ) -> None:
        rng = np.random.default_rng(seed)
        steps = rng.normal(0.0, walk * 1e-6 / 60.0, last)
        self.times = np.arange(last + 1.0)
        self.rates = ppm * 1e-6 + drift * 1e-6 * self.times / 3600.0
        self.rates[1:] += np.cumsum(steps)
        means = (self.rates[1:] + self.rates[:-1]) / 2.0
        self.phases = np.concatenate([[0.0], np.cumsum(means)])
        self.steady = ppm * 1e-6 if not (drift or walk) else None
        self.start = random.Random(seed).randrange(2**32)

    def rate(self, at: float) -> float:
        return float(np.interp(at, self.times, self.rates))

    def mean(self, end: float, begin: float = 0.0) -> float:
        ends = np.interp([begin, end], self.times, self.phases)
        return float((ends[1] - ends[0]) / (end - begin))

    def tick(self, at: float) -> int:
        """The counter as a u32; whole seconds exactly, so that no rounding of floats shows."""
        whole = int(at)
        if self.steady is None:
            phase = float(np.interp(at, self.times, self.phases))
        else:
            phase = self.steady * at
        return (self.start + whole * HZ + math.floor((at - whole + phase) * HZ)) % 2**32


def compared(
    clock: Clock, seed: int, span: float, every: float = 0.4, delay: Delay | None = None, begin=0.0
) -> list[ClockSample]:
    """Pings at uneven distances, delayed on both ways."""
    rng = random.Random(seed)
    wait = delay or DELAYS["exponential"]
    found, at = [], begin
    while at < begin + span:
        there = at + TRIP_S / 2 + wait(rng) * 0.3
        back = there + TRIP_S / 2 + wait(rng)
        found.append(ClockSample(round(at * 1e9), round(back * 1e9), clock.tick(there)))
        at += every * rng.uniform(0.5, 1.5)
    return found


def seconds(clock: Clock, first: int, count: int, ppm: float = 0.0, number: int = 1) -> list[Pulse]:
    """Each pulse of a reference that is off by `ppm`, asked for 0.3 s later."""
    found = []
    for n in range(count):
        at = first + n / (1.0 + ppm * 1e-6)
        asked = round((at + 0.3) * 1e9)
        tick = clock.tick(at)
        found.append(Pulse(asked, asked + 700_000, (number + n) % 2**16, tick))
    return found


def moved(record, ns: int):
    """Put a sample or a pulse so much later by the host's clock; the board's count stays."""
    return record._replace(
        host_send_ns=record.host_send_ns + ns, host_recv_ns=record.host_recv_ns + ns
    )


def ppm(hz: float, true: float) -> float:
    """Error of a rate, where the true one is `true` off nominal, relative."""
    return (hz / HZ - 1.0 - true) * 1e6
