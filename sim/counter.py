"""The virtual board's time: a 32-bit counter on a resonator that is a little off, and drifts."""

from __future__ import annotations

import random

_STEP_NS = 10 * 10**9  # a rate lasts so long; nobody can tell from one that changes all the time
_HOUR_STEPS = 360


class Counter:
    """Counts ticks of virtual time.

    Parameters
    ----------
    nominal_hz, ppm
        Nominal rate, and how far the true rate is off at virtual time 0.
    start
        Count at virtual time 0; may be set anew, as a reset does.
    drift_ppm
        By how much the rate changes in an hour.
    wander_ppm
        Standard deviation, after an hour, of a random walk of the rate.
    seed
        Chooses that walk.
    """

    def __init__(
        self,
        nominal_hz: int,
        ppm: float,
        start: int,
        *,
        drift_ppm: float = 0.0,
        wander_ppm: float = 0.0,
        seed: int = 0,
    ) -> None:
        self.start = start
        self._nominal_hz = nominal_hz
        self._ppm = ppm
        self._drift = drift_ppm / _HOUR_STEPS
        self._wander = wander_ppm / _HOUR_STEPS**0.5
        self._random = random.Random(f"resonator {seed}")
        # Rates of the steps in nHz, and ticks·10¹⁸ before each: integers are exact over years.
        self._rates = [self._nhz(ppm)]
        self._counts = [0]

    def hz(self, when_ns: int = 0) -> float:
        """Return the true rate at a moment."""
        return self._rates[self._step(when_ns)] / 1e9

    def tick_at(self, when_ns: int) -> int:
        """Read the counter (u32) at a moment."""
        step = self._step(when_ns)
        count = self._counts[step] + (when_ns - step * _STEP_NS) * self._rates[step]
        return (self.start + count // 10**18) % 2**32

    def _step(self, when_ns: int) -> int:
        """Find the step of a moment; a rate that does not change has one."""
        if not self._drift and not self._wander:
            return 0
        step = max(0, when_ns // _STEP_NS)
        while len(self._rates) <= step:
            self._counts.append(self._counts[-1] + _STEP_NS * self._rates[-1])
            self._ppm += self._drift + self._random.gauss(0.0, self._wander)
            self._rates.append(self._nhz(self._ppm))
        return step

    def _nhz(self, ppm: float) -> int:
        return self._nominal_hz * 10**9 + round(self._nominal_hz * ppm * 1000)
